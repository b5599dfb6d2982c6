"""Does the page of `bslam live` keep up? Opens it in a headless browser and counts what the browser draws.

    .venv/bin/python tools/measure_live.py paper_room
    .venv/bin/python tools/measure_live.py paper_room --sensor camera --picture docs/img/live.jpg

The drive goes on by the clock, 25 steps a second, whatever the page does; the page draws the newest step as
often as it can. Printed are the time of the drive that went by in a second, the steps that the page showed in
it, how old what it showed was (against the promptest one, median and 95 %), and CPU time, which does not
count what else the machine does: of this program's process for each step of the drive, filter and simulator
included, and of the browser's main thread for each step shown. Exit status 0: the drive kept its time, and
what was shown was at most half a second old. All words but the options below go to `bslam live`.
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

import numpy as np
from playwright.sync_api import CDPSession, Page, sync_playwright

# Counts in the page, after each frame that the browser draws: asking from here would cost it more.
STEP_MS = 40.0
ON_TIME = 0.98
"""Share of its own speed that the drive must have: a second more or less in a minute nobody sees."""
AGE_MAX_S = 0.5
COUNT = """
() => {
  window.steps = new Map();
  const status = Bokeh.documents[0].roots().find(one => one.name === "status");
  const look = () => {
    const found = status.text.match(/step (\\d+) of/);
    if (found && !window.steps.has(Number(found[1]))) window.steps.set(Number(found[1]), performance.now());
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
    """Count for so long, and print; True if the drive kept its time and the page followed."""
    page.get_by_text(re.compile(r"running · step [1-9]")).wait_for()
    page.evaluate(COUNT)
    session = page.context.new_cdp_session(page)
    session.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    session.send("Performance.enable")
    began_s, began_cpu_s, began_server_s = time.monotonic(), cpu_s(session), process_cpu_s(server)
    time.sleep(seconds)
    shown = np.array(page.evaluate("[...window.steps]"))  # (k, 2) step, and when it was first shown, ms
    took_s = time.monotonic() - began_s
    drive_ms, clock_ms = STEP_MS * (shown[:, 0] - shown[0, 0]), shown[:, 1] - shown[0, 1]
    browser_ms = 1e3 * (cpu_s(session) - began_cpu_s) / len(shown)
    server_ms = STEP_MS * 1e3 * (process_cpu_s(server) - began_server_s) / drive_ms[-1]
    on_time = float(drive_ms[-1] / clock_ms[-1])
    late_ms = clock_ms - drive_ms
    age_s = 1e-3 * np.percentile(late_ms - late_ms.min(), [50.0, 95.0])
    print(f"{on_time:.2f} s of drive and {len(shown) / took_s:.1f} shown steps a second, ", end="")
    print(f"{age_s[0]:.2f} s old (95 %: {age_s[1]:.2f} s); ", end="")
    print(f"CPU time: {server_ms:.1f} ms a step here, {browser_ms:.1f} ms a shown step in the browser")
    return on_time >= ON_TIME and bool(age_s[1] <= AGE_MAX_S)


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
