"""`bslam check`: test a log before it is believed."""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from bslam.commands.arguments import core_parameters
from bslam.commands.replay import COLLECTIONS, log_sources
from bslam.datasets.datasets import SIGNS, find_directory, line_to_type
from bslam.datasets.mrclam import ROBOTS
from bslam.errors import BslamError
from bslam.logcheck.check import Settings, check_folder, check_log
from bslam.logcheck.finding import Finding, Report
from bslam.logcheck.picture import draw_picture
from bslam.recording.reader import SUFFIX
from bslam.runs.output import SCHEMA, write_atomically, write_json
from bslam.runs.sources import RecordingSource
from bslam.view.style import png

SUMMARY = "test a log before it is believed: signs, units, delay, scales, noise, identities, stamps"
EXAMPLES = """examples:
  bslam check my_drive
  bslam check csv recordings/* --out out/check
  bslam check mrclam MRCLAM_Dataset6 --robot 3
  bslam check out/run/paper_room_seed0.mcap
  bslam check my_drive --set sighting_delay_us=120000

Tested without ground truth: mirrored bearings, swapped wheels, degrees for radians, millimetres for metres,
delay of the sightings, scale of way and turn, noise against what is told, identities exchanged or missing,
stamps. For each finding: what, how sure, and the option or the edit that mends it. A note is true, but usual.
Logs are named as in `bslam replay`; a folder may be named alone. A DIR that is no path is looked for in the
directory named by BSLAM_DATA, else in ../shared/data.
Writes summary.json, and for most findings a picture of the evidence. Exit status 1: something was found."""


_MENDS = ("forward_scale", "turn_scale", "sighting_delay_us")
"""Settings that a finding may ask for."""
_HOW_TO_MEND = """mends that begin with --: options of `bslam replay csv DIR`
--set: of `bslam check`, too, to test again; for good: KEY = VALUE under [settings] of robot.toml"""

Check = tuple[str, Callable[[Settings], Report]]
"""A log's name, and what checks it with these settings."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "logs", nargs="+", metavar="LOG", help="folders or recordings; or csv DIR..., mrclam DIR..., dlr DIR"
    )
    parser.add_argument(
        "--robot", type=int, choices=range(1, ROBOTS + 1), help="mrclam: one robot (default: all)"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help=f"test again with a mend, of {', '.join(_MENDS)}; may be repeated",
    )
    parser.set_defaults(params=None)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/check"),
        metavar="DIR",
        help="where files go (default: out/check)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    entries = []
    settings = _settings(arguments)
    checks = list(_checks(arguments.logs, arguments.robot))
    _remove_pictures(arguments.out)
    for name, check in checks:
        report = check(settings)
        entries.append(_entry(name, report, arguments.out))
        print(replace(report, name=name))
        write_json(arguments.out / "summary.json", {"schema": SCHEMA, "logs": entries})
    mends = [one["mend"] for entry in entries for one in (*entry["findings"], *entry["notes"])]
    if any(mend.startswith("--") for mend in mends):
        print(_HOW_TO_MEND)
    print(f"files in {arguments.out}: summary.json" + (", NAME.N.png" if _pictures(entries) else ""))
    return 1 if any(entry["findings"] for entry in entries) else 0


def _settings(arguments: argparse.Namespace) -> Settings:
    """What --set asks for. Raises BslamError."""
    chosen = core_parameters(arguments)
    for key in chosen:
        if key not in _MENDS:
            raise BslamError(f"--set {key}: a check does not depend on it; allowed: {', '.join(_MENDS)}")
    return tuple(chosen.items())


def _checks(words: list[str], robot: int | None) -> Iterator[Check]:
    """Each log and how it is checked. Raises BslamError."""
    kind, *directories = words
    if kind not in COLLECTIONS:
        for word in words:
            yield from [_recording(word)] if word.endswith(SUFFIX) else _folder(_kind_of(word), word, robot)
        return
    if not directories:
        raise BslamError(f"{kind}: no DIR; allowed: bslam check {kind} DIR...")
    for directory in directories:
        yield from _folder(kind, directory, robot)


def _kind_of(word: str) -> str:
    """The format of a folder that is named alone."""
    for kind, sign in SIGNS.items():
        with contextlib.suppress(BslamError):
            if any(find_directory(word, COLLECTIONS[kind]).glob(sign)):
                return kind
    allowed = f"csv DIR, mrclam DIR, dlr DIR, or a recording, FILE{SUFFIX}"
    raise BslamError(f"'{word}': no log that is known; allowed: {allowed}{line_to_type('check', word)}")


def _folder(kind: str, directory: str, robot: int | None) -> Iterator[Check]:
    for source in log_sources(kind, [directory], robot):
        if kind == "csv":
            folder = find_directory(directory, COLLECTIONS[kind])
            yield source.name, lambda settings, folder=folder: check_folder(folder, settings)  # type: ignore[misc]
        else:
            yield source.name, lambda settings, source=source: check_log(source.load(), settings)  # type: ignore[misc]


def _recording(word: str) -> Check:
    source = RecordingSource(Path(word))
    return source.name, lambda settings: check_log(source.load(), settings)


def _entry(name: str, report: Report, out: Path) -> dict[str, Any]:
    """What summary.json has of a log; the pictures are written."""
    found = [one for one in report.findings if not one.is_note]
    return {
        "name": name,
        "findings": [_saved(name, number, one, out) for number, one in enumerate(found, start=1)],
        "notes": [_words(one) for one in report.findings if one.is_note],
        "not_tested": report.untested,
        "estimates": report.estimates,
    }


def _words(one: Finding) -> dict[str, Any]:
    return {"kind": one.kind, "what": one.what, "sure": one.sure, "mend": one.mend, "figures": one.figures}


def _saved(name: str, number: int, one: Finding, out: Path) -> dict[str, Any]:
    if one.picture is None:
        return _words(one)
    file = f"{name}.{number}.png"
    write_atomically(out / file, png(draw_picture(one.picture, one.what)))
    return _words(one) | {"picture": file}


def _remove_pictures(out: Path) -> None:
    """Those that the summary there names: it is replaced, and they are of another check."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        entries = json.loads((out / "summary.json").read_text(encoding="utf-8"))["logs"]
        for one in (one for entry in entries for one in entry["findings"] if "picture" in one):
            (out / Path(one["picture"]).name).unlink(missing_ok=True)


def _pictures(entries: list[dict[str, Any]]) -> bool:
    return any("picture" in one for entry in entries for one in entry["findings"])
