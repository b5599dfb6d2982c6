"""Signs and units: what the flow of the sightings says of odometry, told by a table of slips."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from bslam.log import ODOMETRY_COLUMNS, Log
from bslam.logcheck.drive import Drive, Factors, Floats
from bslam.logcheck.finding import Curve, Finding, Picture
from bslam.logcheck.flow import Flow
from bslam.logcheck.reference import Fitted

UNITS: Final = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048}
_DEGREE: Final = math.pi / 180.0
_GROSS: Final = math.log(2.2)  # a factor beyond it is of a unit
_SAME: Final = math.log(1.45)  # a factor so near to a slip's is that slip's
_SURE: Final = 5.0  # standard errors of a sign
_FASTEST_MPS: Final = 30.0

Slip = tuple[str, str, str, Factors]
"""Kind, what is wrong, which numbers are to be multiplied, and by what."""


def is_gross(factor: float) -> bool:
    """Whether only a wrong unit can be so far off."""
    return abs(math.log(factor)) > _GROSS


def unit_slip(log: Log, drive: Drive, flow: Flow) -> tuple[Factors, Finding] | None:
    """The slip of units that explains most of the flow; None if it needs none. Others may show after it."""
    kind, what, columns, factors = min(
        _slips(log, drive.row_s), key=lambda slip: _misfits(slip[3], flow).sum()
    )
    before, after = _misfits(Factors(), flow), _misfits(factors, flow)
    is_mended = before.sum() - after.sum() > _GROSS and after[before != after].max() < _SAME
    sure = f"sightings show {flow.way:.4g} of odometry's way and {flow.turn:.4g} of its turn"
    if not is_mended and log.odometry.kind == "velocity" and _speed(drive) > _FASTEST_MPS:
        what, columns = "v_mps and range_m are in millimetres", "v_mps and range_m"
        kind, factors = "units", Factors(way=1e-3, range=1e-3)
        sure += f"; as told it drives {_speed(drive):.0f} m/s"
    elif not is_mended:
        return None
    factor = next(one for one in vars(factors).values() if one != 1.0)
    return factors, Finding(kind, what, sure, f"multiply {columns} by {factor:.6g}", {"factor": factor})


def unknown_unit(log: Log, flow: Flow) -> Iterator[Finding]:
    """Odometry that is as much off in its way as in its turn, by no unit's factor."""
    way, turn = abs(flow.way), abs(flow.turn)
    if log.odometry.kind == "velocity" or not (way > 0.0 and turn > 0.0 and is_gross(way) and is_gross(turn)):
        return
    ends = sorted((turn, abs(flow.turn_most))) if math.isfinite(flow.turn_most) else [turn, turn]
    if not math.exp(-_SAME) * ends[0] < way < math.exp(_SAME) * ends[1]:
        return
    ticks = log.odometry.kind == "ticks"
    columns = "left_ticks and right_ticks" if ticks else "left_m and right_m"
    times = f"{1.0 / way:.3g} times too large" if way < 1.0 else f"{way:.3g} times too small"
    what = f"odometry: {columns} are about {times}, and in no unit that is known"
    sure = f"sightings show {flow.way:.3g} of odometry's way and {flow.turn:.3g} of its turn"
    mend = (
        "mend ticks_per_revolution, left_radius_m and right_radius_m of robot.toml"
        if ticks
        else "write metres; counters as left_ticks, right_ticks, with the four keys of robot.toml"
    )
    yield Finding("units", what, sure, mend, {"factor": way})


def _slips(log: Log, row_s: float) -> Iterator[Slip]:
    kind = log.odometry.kind
    columns = " and ".join(("left_radius_m", "right_radius_m") if kind == "ticks" else ODOMETRY_COLUMNS[kind])
    for name, unit in UNITS.items():
        yield "units", f"sightings.csv: range_m is in {name}", "range_m", Factors(range=unit)
        if kind == "velocity":
            yield "units", f"odometry.csv: v_mps is in {name}", "v_mps", Factors(way=unit)
            continue
        yield "units", f"odometry: {columns} are in {name}", columns, Factors(unit, unit)
        both = f"{columns} and range_m"
        yield "units", f"odometry and sightings: {both} are in {name}", both, Factors(unit, unit, 1.0, unit)
        if kind == "wheels":
            speeds = "odometry.csv: left_m and right_m are speeds, m/s"
            yield "units", speeds, columns, Factors(row_s, row_s)
        yield "units", f"robot.toml: wheelbase_m is in {name}", "wheelbase_m", Factors(turn=1.0 / unit)
    if kind == "velocity":
        yield "degrees", "odometry.csv: omega_radps is in degrees", "omega_radps", Factors(turn=_DEGREE)
        yield "stamps", "odometry.csv: time_us is in milliseconds", "time_us", Factors(1e3, 1e3)


def _misfits(factors: Factors, flow: Flow) -> Floats:
    """How far way and turn of the flow are, as logarithms, from what these factors would mend."""
    turns = sorted(abs(one) for one in (flow.turn, flow.turn_most) if math.isfinite(one) and one)
    turn = min(max(factors.turn, turns[0]), turns[-1]) / factors.turn if turns else 1.0
    way = abs(flow.way) * factors.range / factors.way if math.isfinite(flow.way) and flow.way else 1.0
    return np.abs(np.log([way, turn]))


def _speed(drive: Drive) -> float:
    """The usual one while it drives."""
    speeds = np.abs(np.diff(drive.odometry.way_m) / np.diff(drive.odometry.time_s))
    moving = speeds > 0.1 * np.max(speeds, initial=0.0)
    return float(np.median(speeds[moving])) if moving.any() else 0.0


def signs(flow: Flow) -> Factors:
    """-1 for what runs against the sightings, without a doubt."""
    turn = -1.0 if flow.turn < -_SURE * flow.turn_error else 1.0
    return Factors(-1.0 if flow.way < -_SURE * flow.way_error else 1.0, turn)


def sign_findings(log: Log, signed: Factors, flow: Flow, fitted: list[Fitted]) -> Iterator[Finding]:
    """Whose sign is wrong. Mirrored bearings and swapped wheels look alike but for the hand of the map."""
    hands = {one.is_mirrored for one in fitted}
    is_mirrored = hands == {True}
    by = "; no beacons.csv or truth.csv tells which" if len(hands) != 1 else ""
    by = by or f"; with that, the map fits {fitted[0].what} {'mirrored' if is_mirrored else 'unmirrored'}"
    left, right = (np.mean(np.abs(flow.shifted_rad + sign * flow.turned_rad)) for sign in (1.0, -1.0))
    sure = (
        f"bearings show {flow.turn:.3f} +- {flow.turn_error:.3f} of odometry's turn; they are off by "
        f"{left:.4f} rad on average as told, by {right:.4f} with the sign changed{by}"
    )
    a, b = ODOMETRY_COLUMNS[log.odometry.kind]
    is_velocity = log.odometry.kind == "velocity"
    swap = f"multiply {b} by -1" if is_velocity else f"exchange the columns {a} and {b}"
    mirror = "multiply bearing_rad of sightings.csv by -1"
    curves = [Curve("pairs of sightings", flow.turned_rad, flow.shifted_rad)]
    picture = Picture("turn by odometry, rad", "change of the bearing, rad", curves)
    swapped = "the turn has the wrong sign" if is_velocity else "left and right wheel are swapped"
    either = f"bearings are mirrored, or {swapped}"
    table = {
        (-1.0, -1.0): ("swapped wheels", "odometry runs backward", "change the sign of odometry"),
        (-1.0, 1.0): ("mount", "the sensor looks backward", "turn sensor_yaw_rad of robot.toml by pi"),
        (1.0, -1.0): ("swapped wheels", swapped, swap),
    }
    kind, what, mend = table.get((signed.way, signed.turn), ("mirrored bearings", "", ""))
    if (signed.way, signed.turn) == (1.0, -1.0) and len(hands) != 1:
        kind, what, mend = "mirrored bearings", either, f"{mirror}; or {swap}"
    elif (signed.way, signed.turn) == (1.0, -1.0) and is_mirrored:
        kind, what, mend = "mirrored bearings", "bearings are mirrored", mirror
    elif not what and is_mirrored:
        file = fitted[0].what
        what, sure = f"{file} is mirrored, or both bearings and wheels are", f"the map fits {file} mirrored"
        mend = f"multiply y_m of {file} by -1; or {mirror}, and {swap}"
    if what:
        yield Finding(kind, what, sure, mend, {"turn": flow.turn, "error": flow.turn_error}, picture)
