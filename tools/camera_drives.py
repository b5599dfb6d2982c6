"""What the tools that measure on rendered drives are asked: which drives, by which cameras."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from bslam.commands.arguments import seeds_range

ROOT = Path(__file__).resolve().parent.parent


def arguments(
    doc: str | None, seeds: range, add: Callable[[argparse.ArgumentParser], None] | None = None
) -> argparse.Namespace:
    """seeds, scenario, rig, sigma (m/s) and store (where rendered drives are kept), from the command line;
    and what `add` adds.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--seeds", type=seeds_range, default=seeds, metavar="A:B", help=f"default: {seeds.start}:{seeds.stop}"
    )
    parser.add_argument("--scenario", default="paper_room")
    parser.add_argument("--rig", default="three60")
    parser.add_argument("--sigma", type=float, default=0.6, metavar="M/S", help="the wheels' (default: 0.6)")
    parser.add_argument("--store", type=Path, default=ROOT / "out" / "camera", metavar="DIR")
    if add is not None:
        add(parser)
    return parser.parse_args()
