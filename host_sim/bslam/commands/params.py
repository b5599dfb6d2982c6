"""`bslam params`: every parameter of the core."""

from __future__ import annotations

import argparse

from bslam.commands.report import table_of
from bslam.core.slam import Slam

SUMMARY = "list every setting of the core with its default"
EXAMPLES = """examples:
  bslam params
  bslam params --all
  bslam run paper_room --set bearing_sd_rad=0.02 --set gate_d2=0"""
_TITLES = {
    "settings": "settings",
    "expert": "expert: for who knows the filter",
    "tuning": "tuning: what association by appearance weighs by; internal, and not stable",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--all", action="store_true", help="those that are internal and not stable, too")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    found = Slam.parameters()
    rows = [[one.name, f"{one.default:g}", f"{one.low:g} to {one.high:g}"] for one in found]
    heading, *lines = table_of([["", "default", "allowed"], *rows]).splitlines()
    width = max(map(len, lines))
    for group, title in _TITLES.items():
        if group == "tuning" and not arguments.all:
            continue
        print(f"{title}\n{heading.ljust(width)}  meaning")
        for one, line in zip(found, lines, strict=True):
            if one.group == group:
                print(f"{line.ljust(width)}  {one.meaning}")
        print()
    if not arguments.all:
        hidden = sum(one.group == "tuning" for one in found)
        print(f"`bslam params --all` lists {hidden} internal ones, too, of association by appearance")
    return 0
