"""`bslam faults`: inject every fault, and hold what happens against what is promised."""

from __future__ import annotations

import argparse
from pathlib import Path

from tqdm import tqdm

from bslam.commands.arguments import positive_count
from bslam.errors import BslamError
from bslam.faults.device import device_faults, is_clone
from bslam.faults.drives import drive_faults
from bslam.faults.images import image_faults
from bslam.faults.inputs import input_faults
from bslam.faults.memory import memory_faults
from bslam.faults.model import missing_parts
from bslam.faults.places import place_faults
from bslam.faults.promise import Fault, Measured
from bslam.runs.output import write_json

SUMMARY = "inject every fault, and compare what happens with what is promised (docs/FAULTS.md)"
EXAMPLES = """examples:
  bslam faults
  bslam faults --only "power loss" --only kidnapping --seeds 60
  bslam faults --unprotected --only "RAM bit flip"

Writes faults.json. Exit status 1 if a promise is not kept, or if a part of the fault model is not injected.
--unprotected injects them without what protects from them: then no promise should be kept. What needs the
application or an image for a board has make build it first."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="faults whose name has this in it; may be repeated"
    )
    parser.add_argument(
        "--seeds", type=positive_count, default=3, metavar="N", help="drives for each fault (default: 3)"
    )
    parser.add_argument("--unprotected", action="store_true", help="switch off what protects from each")
    parser.add_argument("--out", type=Path, default=Path("out") / "faults", metavar="DIR")


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    faults = all_faults(arguments.seeds)
    chosen = _chosen(faults, arguments.only)
    results = []
    for fault in tqdm(chosen, unit="fault", disable=None):
        measured = _inject(fault, not arguments.unprotected)
        verdict = "as promised" if measured.kept else "NOT AS PROMISED"
        tqdm.write(f"{fault.name}: {fault.promise} | {measured.text} | {verdict}")
        results.append(
            {
                "name": fault.name,
                "promise": fault.promise,
                "protection": fault.protection,
                "measured": measured.text,
                "kept": measured.kept,
            }
        )
    missing = [] if arguments.only else missing_parts(faults)
    for part in missing:
        print(f"{part}: injected by nothing | MISSING")
    kept, promised = sum(bool(one["kept"]) for one in results), len(results) + len(missing)
    write_json(
        arguments.out / "faults.json",
        {
            "schema": 1,
            "protected": not arguments.unprotected,
            "seeds": arguments.seeds,
            "faults": results,
            "missing": missing,
        },
    )
    print(f"{kept} of {promised} as promised")
    return 0 if kept == promised else 1


def _chosen(faults: list[Fault], only: list[str] | None) -> list[Fault]:
    """Those that are asked for. Raises BslamError if there are none, or one that cannot be injected here."""
    chosen = [one for one in faults if only is None or any(word in one.name for word in only)]
    if only is not None and not chosen:
        raise BslamError(f"--only {', '.join(only)}: no such fault; allowed: {_names(faults)}")
    if (far := [one for one in chosen if one.takes_clone]) and not is_clone():
        allowed = "`bslam faults` in a clone of bslam, or --only with others"
        raise BslamError(f"{_names(far)}: the firmware's sources are not here; allowed: {allowed}")
    return chosen


def _inject(fault: Fault, protected: bool) -> Measured:
    """A fault that cannot be injected is a promise that is not kept."""
    try:
        return fault.inject(protected)
    except BslamError as error:
        return Measured(False, f"not injected: {error}")


def all_faults(seeds: int, cut_every: int = 1) -> list[Fault]:
    """Every fault that is promised to be survived: so many drives each, a power cut every few bytes."""
    return [
        *input_faults(),
        *image_faults(),
        *drive_faults(seeds),
        *place_faults(),
        *memory_faults(cut_every),
        *device_faults(),
    ]


def _names(faults: list[Fault]) -> str:
    return ", ".join(one.name for one in faults)
