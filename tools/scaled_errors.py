"""Position and map error of real logs in direction only: rigidly aligned, and with the scale fitted besides.

Reads what `bslam replay --observation direction` wrote, one folder a way of running: a line each, means of
the runs. No direction tells the scale, so an error without it says what directions did tell.
"""

import argparse
import json
from pathlib import Path
from statistics import mean, median
from typing import Any


def line_of(runs: list[dict[str, Any]]) -> str:
    """RMSE in cm of the runs of one folder: mean, and the scaled map's median."""
    rigid_m = mean(run["position_error_m"]["rmse"] for run in runs)
    path_m = mean(run["position_rmse_scaled_m"] for run in runs)
    map_m = mean(run["map_rmse_m"] for run in runs)
    scaled_m = [run["map_rmse_scaled_m"] for run in runs]
    lost = sum(run["diverged"] for run in runs)
    return (
        f"{len(runs)} runs: position {100 * rigid_m:.1f}, scaled {100 * path_m:.1f}; "
        f"map {100 * map_m:.1f}, scaled {100 * mean(scaled_m):.1f} (median {100 * median(scaled_m):.1f}) cm; "
        f"{lost} lost"
    )


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="where summary.json stands")
    for folder in parser.parse_args(argv).folders:
        runs = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["runs"]
        print(f"{folder}: {line_of(runs)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
