"""`bslam params`: every parameter of the core."""

from __future__ import annotations

import argparse

from bslam.commands.report import table_of
from bslam.core.slam import Slam

SUMMARY = "list every parameter of the core with its default"
EXAMPLES = """examples:
  bslam params
  bslam run paper_room --set bearing_sd_rad=0.02 --set gate_d2=0"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The command has no arguments."""


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    rows = [[one.name, f"{one.default:g}", f"{one.low:g} to {one.high:g}"] for one in Slam.parameters()]
    meanings = ["meaning", *(one.meaning for one in Slam.parameters())]
    lines = table_of([["parameter", "default", "allowed"], *rows]).splitlines()
    width = max(map(len, lines))
    print("\n".join(f"{line.ljust(width)}  {meaning}" for line, meaning in zip(lines, meanings, strict=True)))
    return 0
