"""Options that several commands share, and what they become."""

from __future__ import annotations

import argparse
import math
import tomllib
from collections.abc import Callable, Container, Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import joblib

from bslam.commands.helping import more_options
from bslam.core.presets import PRESETS
from bslam.core.slam import Slam
from bslam.errors import BslamError, did_you_mean, setting_instead
from bslam.log import WHEEL_NOISES, WHEEL_SPEED_SIGMA_MPS, Robot
from bslam.maps.blob import SUFFIX
from bslam.options import (
    ALIGNMENTS,
    ASSOCIATIONS,
    FILTERS,
    MOTIONS,
    OBSERVATIONS,
    REALS,
    RECOVERIES,
    SENSORS,
    Number,
    RunOptions,
    parse_association,
)
from bslam.rig import load_rig
from bslam.runs.camera import SCANNER_THRESHOLD, TOLD_THRESHOLD, UNTOLD_THRESHOLD
from bslam.runs.sources import CameraSource, Says, ScenarioSource, options_for
from bslam.target.lines import TARGET_KINDS, no_such_target, qemu_machines
from bslam.world.scenario import load_scenario

T = TypeVar("T")

# Rendering takes about a minute a drive: what a later command needs again is kept here.
CAMERA_STORE = Path("out") / "camera"
DEFAULT_RIG = "three60"


def add_filter_options(
    parser: argparse.ArgumentParser, lists: Container[str] = (), folded: bool = False
) -> None:
    """How the filter runs. `lists` names the options that take several values, with commas between; folded:
    all of them are among the "more options" of the help.
    """
    group = more_options(parser) if folded else parser.add_argument_group("filter")

    def add(name: str, parse: Callable[[str], Any], default: Any, shape: str, meaning: str) -> None:
        if name in lists:
            parse, default, shape = _list_of(parse), default and [default], f"{shape},..."
        group.add_argument(f"--{name}", type=parse, default=default, metavar=shape, help=meaning)

    add(
        "observation",
        _word(OBSERVATIONS),
        "distance" if "observation" in lists else None,
        "WHAT",
        "distance (with bearing), or direction: bearing-only (default: as the log)",
    )
    meaning = f"whose a sighting is: known:RATE, {', '.join(ASSOCIATIONS)} (default: as the sightings allow)"
    add("association", _association, None, "METHOD", meaning)
    meaning = f"{', '.join(FILTERS)} (default: invariant; bearing-only: smoother)"
    add("filter", _word(FILTERS), None, "NAME", meaning)
    meaning = "noise of a wheel's speed (default: as the scenario or log says)"
    add("sigma", _sigma_mps, None, "M/S", meaning)
    group.add_argument(
        "--preset",
        dest="presets",
        action="append",
        type=_word(PRESETS),
        default=[],
        metavar="NAME",
        help=f"settings: {', '.join(PRESETS)}; may be repeated (default: by what the log says)",
    )
    group.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="any setting (see `bslam params --all`); wins over all else; may be repeated",
    )
    _add_more_options(more_options(parser))


def _add_more_options(group: Any) -> None:
    """Which core runs where, and what few users change."""
    group.add_argument("--motion", choices=MOTIONS, default="arc", help="odometry step (default: arc)")
    group.add_argument(
        "--velocity-states",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="v and omega in the state (default: as the presets have it)",
    )
    group.add_argument(
        "--noise",
        choices=WHEEL_NOISES,
        help="what errs: the reading or the motion (default: as the scenario or log says)",
    )
    group.add_argument(
        "--params", type=Path, metavar="FILE", help="TOML file of settings, as `calibrate` writes"
    )
    group.add_argument(
        "--target",
        type=_target,
        default="host",
        metavar="{host,qemu:BOARD,serial:DEVICE}",
        help="where the core runs: here, on an emulated board, on a robot (default: host)",
    )
    group.add_argument(
        "--real", choices=REALS, default="float", help="scalar type: float as on the target, or double"
    )
    _add_map_options(group)


def _add_map_options(group: Any) -> None:
    """What is known of the place before, and how the robot finds itself in it."""
    group.add_argument(
        "--known-map",
        action="store_true",
        help="give the filter the true beacons: it localises and changes none (paper equation (12))",
    )
    group.add_argument(
        "--map",
        type=Path,
        metavar=f"FILE{SUFFIX}",
        help="start in a kept map, at a place that nobody knows (see `bslam map`)",
    )
    group.add_argument("--frozen", action="store_true", help="--map: nothing changes a beacon, none is added")
    group.add_argument(
        "--recovery",
        choices=RECOVERIES,
        help="notice when it is lost, and find itself again. growing: when several beacons of the map it "
        "makes fit a pose elsewhere; carried: when one does, too, if nothing new was seen for a while "
        "(default: growing by appearance, carried with --map, else off)",
    )


def add_sensor_options(parser: argparse.ArgumentParser) -> None:
    """Where the sightings come from."""
    group = parser.add_argument_group("sensor")
    group.add_argument(
        "--sensor",
        choices=SENSORS,
        default="simulated",
        metavar="WHICH",
        help="simulated: from geometry (default); camera: rendered images, looked at",
    )
    group = more_options(parser)
    group.add_argument(
        "--rig", help="cameras: three60, wide180, pan60, or a TOML file (default: the scenario's)"
    )
    group.add_argument(
        "--model", type=Path, metavar="FILE", help="camera: your own kinds, the .json of `bslam detect train`"
    )


def scenario_source(
    arguments: argparse.Namespace, seed: int, sigma_mps: float | None, noise: str
) -> ScenarioSource:
    """The simulated drive that the options ask for."""
    if arguments.rig is not None:
        load_rig(arguments.rig)
    if arguments.sensor == "camera":
        threshold = TOLD_THRESHOLD if _is_told(arguments.association) else UNTOLD_THRESHOLD
        threshold = threshold if arguments.model is None else SCANNER_THRESHOLD
        seen = (_rig(arguments), CAMERA_STORE, threshold, arguments.model)
        return CameraSource(arguments.scenario, seed, sigma_mps, noise, *seen)
    for option in ("rig", "model"):
        value = getattr(arguments, option)
        if value is not None:
            raise BslamError(f"--{option} {value}: cameras look by it; allowed: with --sensor camera")
    return ScenarioSource(arguments.scenario, seed, sigma_mps, noise)


def _is_told(association: Any) -> bool:
    """Whether every method that is asked for, one or a list, gets the identities: all see the same."""
    methods = association if isinstance(association, list) else [association]
    return all(method is not None and method[0] == "known" for method in methods)


def _rig(arguments: argparse.Namespace) -> str:
    """The cameras: asked for, else the scenario's."""
    return arguments.rig or load_scenario(arguments.scenario).rig or DEFAULT_RIG


def add_align_option(parser: argparse.ArgumentParser) -> None:
    """How the estimate is brought to a truth that has a frame of its own."""
    parser.add_argument(
        "--align",
        choices=ALIGNMENTS,
        metavar="HOW",
        help=f"to the truth before scoring: {', '.join(ALIGNMENTS)} (default: as the truth needs it)",
    )


def add_algorithm_options(parser: argparse.ArgumentParser) -> Any:
    """Algorithms of the user's own; the group, for more of the kind."""
    group = parser.add_argument_group("algorithms")
    group.add_argument(
        "--with",
        dest="own",
        action="append",
        default=[],
        metavar="MODULE:CLASS",
        help="an algorithm of your own; may be repeated",
    )
    more_options(parser).add_argument(
        "--call-limit",
        type=positive_number,
        default=60.0,
        metavar="S",
        help="an algorithm hangs if one step takes longer, in seconds (default: 60)",
    )
    return group


def add_batch_options(
    parser: argparse.ArgumentParser, command: str, seeds: str = "0:1", pictures: int = 5
) -> None:
    """How many runs, on how many processes, and where the files go."""
    group = parser.add_argument_group("runs")
    group.add_argument(
        "--seeds",
        type=seeds_range,
        default=seeds_range(seeds),
        metavar="A:B",
        help=f"seeds from A up to and without B (default: {seeds})",
    )
    group.add_argument(
        "--jobs",
        type=positive_count,
        default=joblib.cpu_count(),
        metavar="N",
        help="processes (default: cores)",
    )
    group.add_argument(
        "--out",
        type=Path,
        default=Path("out") / command,
        metavar="DIR",
        help=f"where files go; what is there is replaced (default: out/{command})",
    )
    group.add_argument(
        "--pictures",
        type=whole_number,
        default=pictures,
        metavar="N",
        help=f"draw the first N runs (default: {pictures})",
    )


def _check_map(arguments: argparse.Namespace) -> None:
    """Raises BslamError for what cannot be with a map, or without one."""
    if arguments.frozen and arguments.map is None:
        raise BslamError("--frozen: no map; allowed: --map FILE --frozen")
    if arguments.recovery == "off" and arguments.map is not None:
        raise BslamError(
            "--recovery off with --map: the robot would never find itself; allowed: growing, carried"
        )
    if arguments.known_map and arguments.map is not None:
        raise BslamError("--known-map with --map: allowed is one of them")


def run_options(
    arguments: argparse.Namespace, *, says: Says = ScenarioSource.says, **changes: Any
) -> RunOptions:
    """Options of one run; `changes` win, and are needed where the command takes lists.

    says: what the sightings tell; by default as all simulated ones do.
    """
    _check_map(arguments)
    values = {
        "association": arguments.association,
        "observation": arguments.observation,
        "filter": arguments.filter,
        "sigma_mps": arguments.sigma,
        "motion": arguments.motion,
        "presets": tuple(arguments.presets),
        "velocity_states": arguments.velocity_states,
        "noise": arguments.noise,
        "sensor": getattr(arguments, "sensor", "simulated"),
        "rig": _rig(arguments) if getattr(arguments, "sensor", "") == "camera" else None,
        "target": arguments.target,
        "real": arguments.real,
        "known_map": arguments.known_map,
        "kept_map": None if arguments.map is None else str(arguments.map),
        "frozen": arguments.frozen,
        "recovery": arguments.recovery,
        "align": getattr(arguments, "align", None),
        "parameters": tuple(core_parameters(arguments).items()),
    }
    values |= changes
    if values["sensor"] == "recorded":  # how a map lies as a whole is an error of the first metres
        values.setdefault("map_align", "rigid")
    return options_for(says, values)


def core_parameters(arguments: argparse.Namespace) -> dict[str, Number]:
    """What --params and --set ask for; --set wins. Raises BslamError for a name or value that cannot be."""
    chosen: dict[str, Number] = {}
    if arguments.params is not None:
        chosen |= _read_params(arguments.params)
    for text in arguments.set:
        key, equals, value = text.partition("=")
        if not equals:
            raise BslamError(f"--set {text}: no value; allowed: --set KEY=VALUE")
        chosen |= _checked({key.strip(): _number(value, f"--set {key}")}, "--set")
    return chosen


def _read_params(path: Path) -> dict[str, Number]:
    try:
        content = tomllib.loads(path.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise BslamError(f"--params {path}: cannot be read: {error}; allowed: a TOML file") from error
    except tomllib.TOMLDecodeError as error:
        raise BslamError(f"--params {path}: {error}; allowed: lines of KEY = VALUE") from error
    values = {key: _number(str(value), f"--params {path}: {key}") for key, value in content.items()}
    return _checked(values, f"--params {path}")


def _checked(values: dict[str, Number], where: str) -> dict[str, Number]:
    table = {one.name: one for one in Slam.parameters()}
    for key, value in values.items():
        if key not in table:
            if key in (one.name for one in fields(Robot)):
                raise BslamError(f"{where}: {key} is a key of robot.toml; {setting_instead(key, table)}")
            raise BslamError(f"{where}: parameter '{key}' does not exist; {setting_instead(key, table)}")
        one = table[key]
        if not one.low <= value <= one.high or (one.is_integer and value != int(value)):
            kind = "a whole number" if one.is_integer else "a number"
            allowed = f"allowed: {kind} from {one.low:g} to {one.high:g}"
            raise BslamError(f"{where}: parameter {key} = {value}; {allowed}")
    return values


def _number(text: str, where: str) -> Number:
    for kind in (int, float):
        try:
            value = kind(text)
        except ValueError:
            continue
        if math.isfinite(value):
            return value
    raise BslamError(f"{where}: '{text}' is not allowed; allowed: a finite number")


def _list_of(parse: Callable[[str], T]) -> Callable[[str], list[T]]:
    def parse_list(text: str) -> list[T]:
        return [parse(word.strip()) for word in text.split(",")]

    return parse_list


def _word(allowed: Iterable[str]) -> Callable[[str], str]:
    names = tuple(allowed)

    def parse(text: str) -> str:
        if text not in names:
            allowed = f"allowed: {', '.join(names)}{did_you_mean(text, names)}"
            raise argparse.ArgumentTypeError(f"'{text}' does not exist; {allowed}")
        return text

    return parse


def _association(text: str) -> tuple[str, float]:
    try:
        return parse_association(text)
    except BslamError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _target(text: str) -> str:
    kind, _, name = text.partition(":")
    there = kind in TARGET_KINDS and name and (kind != "qemu" or name in qemu_machines())
    if text != "host" and not there:
        raise argparse.ArgumentTypeError(no_such_target(text))
    return text


def _sigma_mps(text: str) -> float:
    try:
        return float(WHEEL_SPEED_SIGMA_MPS.convert(float(text), "sigma"))
    except (ValueError, BslamError):
        allowed = WHEEL_SPEED_SIGMA_MPS.allowed
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: {allowed}") from None


def seeds_range(text: str) -> range:
    """A:B as an option's value."""
    first, colon, end = text.partition(":")
    if not (colon and first.isdecimal() and end.isdecimal() and int(first) < int(end)):
        raise argparse.ArgumentTypeError(
            f"'{text}' is not allowed; allowed: A:B with whole numbers 0 <= A < B"
        )
    return range(int(first), int(end))


def whole_number(text: str) -> int:
    """A whole number from 0, as an option's value."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a whole number from 0")
    return int(text)


def positive_count(text: str) -> int:
    """A whole number from 1, as an option's value."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a whole number from 1")
    return int(text)


def positive_number(text: str) -> float:
    """A number above 0, as an option's value."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not allowed; allowed: a number above 0")
    return value


def _names(words: Iterable[str]) -> str:
    return "{" + ",".join(words) + "}"
