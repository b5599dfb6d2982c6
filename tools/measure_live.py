"""Does the page of `bslam live` keep up? Opens it in a headless browser and counts what the browser draws.

    .venv/bin/python tools/measure_live.py paper_room
    .venv/bin/python tools/measure_live.py paper_room --sensor camera --picture docs/img/live.jpg

Prints how much time of the drive went by in a second, how many different steps the page showed in it (at 25
frames a second of drive, 1 and 25 are right), and what a shown step cost the browser's main thread in CPU
time (below 40 ms it keeps up, if it has a core). All words but the options below go to `bslam live`.
"""

import argparse
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import CDPSession, Page, sync_playwright

# Counts in the page, after each frame that the browser draws: asking from here would cost it more.
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
                print(measure(page, options.seconds))
                if options.picture is not None:
                    page.screenshot(path=options.picture, type="jpeg", quality=80)
                browser.close()
        finally:
            process.send_signal(signal.SIGINT)
    return 0


def measure(page: Page, seconds: float) -> str:
    """Count for so long, in words."""
    page.get_by_text(re.compile(r"running · step [1-9]")).wait_for()
    page.evaluate(COUNT)
    session = page.context.new_cdp_session(page)
    session.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    session.send("Performance.enable")
    began_s, began_cpu_s = time.monotonic(), cpu_s(session)
    time.sleep(seconds)
    steps = page.evaluate("[...window.steps]")
    took_s, took_cpu_s = time.monotonic() - began_s, cpu_s(session) - began_cpu_s
    drive_s = 0.04 * (max(steps) - min(steps))
    rates = f"{drive_s / took_s:.2f} s of drive a second, {len(steps) / took_s:.1f} steps shown a second"
    return f"{rates}, {1e3 * took_cpu_s / len(steps):.0f} ms of the browser's CPU time for each"


def cpu_s(session: CDPSession) -> float:
    """Of the page's main thread so far."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(float(one["value"]) for one in metrics if one["name"] == "TaskDuration")


if __name__ == "__main__":
    sys.exit(main())
