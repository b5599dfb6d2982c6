"""`bslam look`: what the front end sees, drawn into the frames."""

from __future__ import annotations

import argparse
import math
import re
from collections import Counter
from pathlib import Path

from bslam.commands.arguments import positive_count
from bslam.core.vision import Candidate, FrontEnd, Seeing
from bslam.errors import BslamError
from bslam.rig import load_rig
from bslam.runs.camera import NO_BEACON, covering_beacon
from bslam.runs.output import write_atomically
from bslam.runs.shots import VIDEOS, Shot, Source, folder, simulated, video
from bslam.view.frames import RIGHT, UNKNOWN, WRONG, Mark, annotate, contact_sheet, png
from bslam.world.simulate import load_scenario

SUMMARY = "what the camera front end sees: boxes, names, directions and distances drawn into frames"
EXAMPLES = """examples:
  bslam look paper_room --seed 3 --rig wide180 --frames 12
  bslam look my_pictures/
  bslam look drive.mp4 --rig out/calibrate/camera.toml --every 2

SOURCE is a scenario (a name, or the path of a TOML file), a folder of pictures, or a video. Writes each frame
and a contact sheet into --out. Green boxes: on a beacon of the simulated room; red: on none; yellow: there is
nothing to compare with. Your own kinds: bslam detect run."""

_SHEET = "contact_sheet.png"
_FRAMES = 12


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("source", metavar="SOURCE", help="scenario, folder of pictures, or video")
    parser.add_argument(
        "--rig",
        metavar="RIG",
        help="the cameras, a name or a TOML file (default: three60 for a scenario, 60 degrees for pictures)",
    )
    parser.add_argument("--seed", type=int, default=0, help="of a simulated drive (default: 0)")
    parser.add_argument(
        "--frames",
        type=positive_count,
        metavar="N",
        help="frames to show (default: all pictures of a folder, 12 of anything else)",
    )
    parser.add_argument(
        "--every", type=_seconds, default=5.0, metavar="S", help="seconds between them (default: 5)"
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/look"),
        metavar="DIR",
        help="where pictures go; what is there is replaced (default: out/look)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    source = _open(arguments)
    front_end = FrontEnd(source.cameras)
    pictures, reasons = [], Counter[str]()
    for shot in source.shots:
        seeing = front_end.see(shot.rgb, shot.camera, shot.moved)
        if not shot.shown:
            continue
        reasons[seeing.reason] += 1
        marks = [_mark(one, shot) for one in seeing.candidates]
        caption = f"{shot.name}: {_outcome(seeing)}"
        pictures.append(annotate(shot.rgb, marks, caption))
        file = f"{len(pictures):02}_{re.sub(r'[^A-Za-z0-9]+', '_', shot.name)}.png"
        write_atomically(arguments.out / file, png(pictures[-1]))
        print("\n".join([f"{file}: {_outcome(seeing)}", *(f"  {_words(one)}" for one in seeing.candidates)]))
        if len(pictures) == arguments.frames:
            break
    if not pictures:
        raise BslamError(f"{arguments.source}: ends before {arguments.every:g} s; allowed: a shorter --every")
    write_atomically(arguments.out / _SHEET, png(contact_sheet(pictures)))
    print(_counts(reasons))
    if source.caution:
        print(source.caution)
    print(f"files in {arguments.out}: NN_*.png, {_SHEET}")
    return 0


def _open(arguments: argparse.Namespace) -> Source:
    path = Path(arguments.source)
    rig = None if arguments.rig is None else load_rig(arguments.rig)
    if path.is_dir():
        return folder(path, rig)
    frames = arguments.frames or _FRAMES
    if path.suffix.lower() in VIDEOS:
        return video(path, rig, frames, arguments.every)
    scenario = load_scenario(arguments.source)
    rig = rig or load_rig("three60")
    return simulated(scenario, arguments.seed, rig, frames, arguments.every)


def _mark(candidate: Candidate, shot: Shot) -> Mark:
    colour = UNKNOWN
    if shot.identity is not None:
        on_beacon = covering_beacon(candidate.outline, shot.identity) != NO_BEACON
        colour = RIGHT if on_beacon else WRONG
    return Mark(candidate.outline, (candidate.kind, _place(candidate)), colour)


def _place(candidate: Candidate) -> str:
    """Distance and direction, as far as they are measured."""
    if candidate.bearing_rad is None:
        return "not measured"
    distance = "" if candidate.range_m is None else f"{candidate.range_m:.2f} m "
    return f"{distance}{math.degrees(candidate.bearing_rad):+.1f}°"


def _words(candidate: Candidate) -> str:
    """A line about a candidate."""
    parts = [f"{candidate.kind}:", _place(candidate)]
    if candidate.bearing_rad is not None and candidate.bearing_sd_rad is not None:
        parts.append(f"+- {math.degrees(candidate.bearing_sd_rad):.1f}°")
    if candidate.range_m is not None and candidate.range_sd_m is not None:
        parts.append(f"+- {candidate.range_sd_m:.2f} m")
    parts.append(f"score {candidate.score:.2f}")
    if candidate.marks:
        parts.append(f"({', '.join(sorted(candidate.marks))})")
    return " ".join(parts)


def _outcome(seeing: Seeing) -> str:
    """How many candidates, or why there is none."""
    return f"{len(seeing.candidates)} seen" if seeing.candidates else _REASONS[seeing.reason]


_REASONS = {
    "nothing": "a good frame, nothing seen",
    "black": "nothing seen: the frame is black",
    "overexposed": "nothing seen: the frame is overexposed",
    "flat": "nothing seen: one colour all over",
    "unfinished": "nothing seen: rows are missing",
}


def _counts(reasons: Counter[str]) -> str:
    words = ", ".join(f"{count} {reason}" for reason, count in reasons.most_common())
    return f"frames shown, by what came of them: {words}"


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 3600.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: seconds above 0, at most 3600")
    return value
