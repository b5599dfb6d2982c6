"""`bslam map`: look at kept maps, take them apart, put them together."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

from bslam.commands.report import table_of
from bslam.core.builds import SIZE_CLASSES
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.maps.blob import SUFFIX, KeptMap, pack, parse
from bslam.maps.merge import merge
from bslam.maps.text import from_json, to_json
from bslam.runs.kept import ensure_sound, read_blob
from bslam.runs.output import write_atomically
from bslam.view.room import Mapped, Room, draw_room
from bslam.view.style import png

SUMMARY = "show, export, import and merge kept maps"
EXAMPLES = f"""examples:
  bslam run paper_room --out out/first            (leaves out/first/paper_room_seed0{SUFFIX})
  bslam map show out/first/paper_room_seed0{SUFFIX}
  bslam map export out/first/paper_room_seed0{SUFFIX} room.json
  bslam map import room.json room{SUFFIX}
  bslam map merge one{SUFFIX} other{SUFFIX} both{SUFFIX}
  bslam run paper_room --seeds 1:2 --map out/first/paper_room_seed0{SUFFIX}

show prints the beacons and draws NAME.png into --out. export writes JSON, import the map again. merge takes
the second map into the frame of the first: it finds the beacons that both have by labels, looks and geometry,
and is refused where they share too little, or fit together in two ways. docs/MAP.md has every byte."""
_FILES = {"show": 1, "export": 2, "import": 2, "merge": 3}
_USES = {"show": "MAP", "export": "MAP FILE.json", "import": "FILE.json MAP", "merge": "MAP MAP MAP"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("what", choices=tuple(_FILES), help="what to do")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="see the examples")
    parser.add_argument(
        "--out", type=Path, default=Path("out") / "map", metavar="DIR", help="show: where the picture goes"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    what, files = arguments.what, arguments.files
    if len(files) != _FILES[what]:
        raise BslamError(f"map {what}: {len(files)} files; allowed: bslam map {what} {_USES[what]}")
    if what == "show":
        _show(files[0], arguments.out)
    elif what == "export":
        write_atomically(files[1], to_json(read_map(files[0])))
        print(f"written: {files[1]}")
    elif what == "import":
        _write(files[1], _from_text(files[0]))
    else:
        _merge(*files)
    return 0


def read_map(path: Path) -> KeptMap:
    """A map file, taken apart. Raises BslamError with what is wrong."""
    return parse(read_blob(path))


def _from_text(path: Path) -> KeptMap:
    try:
        return from_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"{path}: cannot be read: {error}; allowed: a map as JSON") from error
    except BslamError as error:
        raise BslamError(f"{path}: {error}") from error


def _write(path: Path, kept: KeptMap) -> None:
    try:
        blob = pack(kept)
    except BslamError as error:
        raise BslamError(f"{path}: {error}") from error
    ensure_sound(path, blob)
    write_atomically(path, blob)
    print(f"written: {path}, {len(kept.beacons)} beacons, {len(blob)} bytes")


def _show(path: Path, out: Path) -> None:
    kept = read_map(path)
    slam = Slam(beacons_max=SIZE_CLASSES[-1])
    slam.load_map(path.read_bytes())
    rows = [["uid", "label", "kind", "class", "x m", "y m", "sd m", "scale", "sightings", "machine"]]
    mapped = []
    for one, seen in zip(kept.beacons, slam.beacons(), strict=True):
        sd_m = math.sqrt(max(float(np.trace(seen.covariance_m2)), 0.0))
        label = str(one.label) if one.label >= 0 else "-"
        machine = "-" if one.machine is None else str(one.machine)
        scale = f"{one.scale:.2f}" if one.scale else "-"
        place = [f"{one.x_m:.2f}", f"{one.y_m:.2f}", f"{sd_m:.2f}"]
        words = [str(one.uid), label, one.kind, str(one.beacon_class or "-")]
        rows.append([*words, *place, scale, str(one.sightings), machine])
        mapped.append(Mapped(one.x_m, one.y_m, seen.covariance_m2, True, "" if one.label < 0 else label))
    print(table_of(rows))
    room = Room(f"{path.name}: {len(kept.beacons)} beacons", np.zeros((1, 2)), mapped=mapped)
    picture = out / f"{path.stem}.png"
    write_atomically(picture, png(draw_room(room)))
    print(f"drawn: {picture}")


def _merge(first: Path, second: Path, out: Path) -> None:
    kept = read_map(first), read_map(second)
    try:
        both = merge(*kept)
    except BslamError as error:
        raise BslamError(f"{first} and {second}: {error}") from error
    _write(out, both.kept)
    x_m, y_m, theta_rad = both.move
    sd_x_m, sd_y_m, sd_rad = both.move_sd
    print(
        f"{len(both.shared)} beacons in both; the second map's origin lies at x {x_m:.2f} ({sd_x_m:.2f}) m, "
        f"y {y_m:.2f} ({sd_y_m:.2f}) m, turned by {theta_rad:.3f} ({sd_rad:.3f}) rad in the first"
    )
    if both.rays_left_out:
        print(f"left out: {both.rays_left_out} beacons whose distance nobody knows")
