"""Does the page of `bslam live` keep up? Opens it in a headless browser and counts what the browser draws.

    .venv/bin/python tools/measure_live.py paper_room
    .venv/bin/python tools/measure_live.py paper_room --sensor camera --picture docs/img/live.jpg

Prints how much time of the drive went by in a second, how many different steps the page showed in it (at 25
frames a second of drive, 1 and 25 are right, on a machine that has nothing else to do), and what a shown step
cost in CPU time, which does not count what else the machine does: this program's process, filter and
simulator included, and the browser's main thread. Exit status 0: both are below the 40 ms from one step to
the next, so that either keeps up if it has a core. All words but the options below go to `bslam live`.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import CDPSession, Page, sync_playwright

# Counts in the page, after each frame that the browser draws: asking from here would cost it more.
STEP_MS = 40.0
COUNT = """
() => {
  window.steps = new Set();
  const status = Bokeh.documents[0].roots().find(one => one.name === "status");
  const look = () => {
    const found = status.text.match(/step (\\d+) of/);
    if (found) window.steps.add(Number(found[1]));
    requestAnimationFrame(look);
  };
  look();
}
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="how long it counts (default: 20)")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="a screenshot at the end, as JPEG")
    options, words = parser.parse_known_args(argv)
    kept_up = False
    command = [sys.executable, "-m", "bslam", "live", *words, "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = re.search(r"http://[^;\s]+", process.stdout.readline())
        if found is None:
            return process.wait()
        try:
            with sync_playwright() as playwright:
                path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
                browser = playwright.chromium.launch(executable_path=path)
                page = browser.new_page(viewport={"width": 1215, "height": 890})
                page.goto(found[0])
                kept_up = measure(page, process.pid, options.seconds)
                if options.picture is not None:
                    page.screenshot(path=options.picture, type="jpeg", quality=80)
                browser.close()
        finally:
            process.send_signal(signal.SIGINT)
    return 0 if kept_up else 1


def measure(page: Page, server: int, seconds: float) -> bool:
    """Count for so long, and print; True if a step costs both sides less than the time it stands for."""
    page.get_by_text(re.compile(r"running · step [1-9]")).wait_for()
    page.evaluate(COUNT)
    session = page.context.new_cdp_session(page)
    session.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    session.send("Performance.enable")
    began_s, began_cpu_s, began_server_s = time.monotonic(), cpu_s(session), process_cpu_s(server)
    time.sleep(seconds)
    steps = page.evaluate("[...window.steps]")
    took_s = time.monotonic() - began_s
    browser_ms = 1e3 * (cpu_s(session) - began_cpu_s) / len(steps)
    server_ms = 1e3 * (process_cpu_s(server) - began_server_s) / len(steps)
    drive_s = 1e-3 * STEP_MS * (max(steps) - min(steps))
    print(f"{drive_s / took_s:.2f} s of drive and {len(steps) / took_s:.1f} shown steps a second; ", end="")
    print(f"CPU time for each: {server_ms:.1f} ms here, {browser_ms:.1f} ms in the browser")
    return max(server_ms, browser_ms) < STEP_MS


def process_cpu_s(pid: int) -> float:
    """Of all its threads so far; Linux."""
    words = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def cpu_s(session: CDPSession) -> float:
    """Of the page's main thread so far."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(float(one["value"]) for one in metrics if one["name"] == "TaskDuration")


if __name__ == "__main__":
    sys.exit(main())
