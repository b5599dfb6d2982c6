"""From figures to findings: what is wrong, how sure that is, and what mends it.

Limits lie above what good logs have. A scale may be off by what is usual and, besides, by what the noise that
is told covers: a run believes no more than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from bslam.log import Log
from bslam.logcheck.batch import DELAY, relative
from bslam.logcheck.drive import LEAST_SD, Drive
from bslam.logcheck.finding import Curve, Finding, Picture
from bslam.logcheck.flow import DELAYS_S, Flow
from bslam.logcheck.identity import Exchange, exchanges
from bslam.logcheck.reference import Fitted
from bslam.logcheck.solution import Estimate, Noise, Solution
from bslam.logcheck.units import UNITS, is_gross

_SURE: Final = 5.0  # standard errors
_LIKELY: Final = 10.0  # gain of log-likelihood
# Usual in good logs. Robots that follow commands slip: they drive and turn less than they are told.
_WAY_OFF, _WAY_OFF_COMMANDED = 0.03, 0.085
_TURN_OFF, _TURN_OFF_COMMANDED = 0.045, 0.135
_WHEEL_OFF: Final = 0.03
_YAW_OFF_RAD: Final = 0.08
_SIZE_OFF: Final = 0.05  # of the map
_SIZE_UNKNOWN: Final = 0.03  # where neither beacons.csv nor truth.csv tells it
_WORTH_A_NOTE: Final = 0.02
_AGREE: Final = 0.15  # flow and fit; else the wheels' noise hides the scale
_DELAY_S: Final = 0.08
_DELAY_ROWS: Final = 2.0
_LEAD_S: Final = 0.3  # of commands before the motion
_SINGLE, _BLOCK = 2.0, 2.5  # noise over what is told
_CAUTIOUS: Final = 0.33
_EXACT_MPS: Final = 0.007
_NAMELESS: Final = 0.05  # share of sightings
_OUTSIDE: Final = 0.2


def missing(log: Log) -> Iterator[Finding]:
    """Sightings that do not say whose they are."""
    nameless = log.sightings.beacon_id[log.sightings.mappable] < 0
    if len(nameless) and nameless.mean() > _NAMELESS:
        what = f"{int(nameless.sum())} of {len(nameless)} sightings have no identity"
        mend = "--association mahalanobis, or svm where there are signatures"
        yield Finding("identities", what, "beacon_id is empty", mend, {"share": float(nameless.mean())})


def outside(log: Log) -> Iterator[Finding]:
    """Sightings of which odometry knows nothing."""
    seen_us, known_us = log.sightings.time_us, log.odometry.time_us
    if len(seen_us) == 0:
        return
    out = (seen_us < known_us[0] - log.robot.step_us) | (seen_us > known_us[-1] + log.robot.step_us)
    if out.mean() > _OUTSIDE:
        what = f"{int(out.sum())} of {len(out)} sightings are before or after odometry"
        sure = (
            f"they run from {seen_us[0]} to {seen_us[-1]} us, odometry from {known_us[0]} to {known_us[-1]}"
        )
        yield Finding(
            "stamps", what, sure, "let one clock stamp both, or shift time_us", {"share": float(out.mean())}
        )


def hanging(drive: Drive) -> Iterator[Finding]:
    """Sightings that stay the same, of a robot that moves."""
    seen = drive.seen
    columns = (seen.label, seen.bearing_rad, np.nan_to_num(seen.range_m))
    if len(np.unique(np.column_stack(columns), axis=0)) == len(np.unique(seen.label)):
        yield Finding(
            "sightings",
            "sightings do not change while odometry moves",
            "each is equal to the first of its beacon",
            "a detector that hangs: let it look anew for each frame",
            {"sightings": len(seen.label)},
        )


def delay(solution: Solution, drive: Drive, flow: Flow) -> Iterator[Finding]:
    """Sightings that come late, or early, beyond what is told."""
    found, gain = solution.delay, solution.delay_gain
    is_untold_lead = drive.is_commanded and drive.delay_s == 0.0
    limit_s = _LEAD_S if is_untold_lead else max(_DELAY_S, _DELAY_ROWS * drive.row_s)
    if abs(found.value) < 0.25 * _DELAY_S or gain < _LIKELY:
        return
    told = f", besides the {1e3 * drive.delay_s:.0f} ms that are told" if drive.delay_s else ""
    late, whole_us = "late" if found.value > 0.0 else "early", round(1e6 * (found.value + drive.delay_s))
    shift = f"add {round(-1e6 * found.value)} to time_us of sightings.csv"  # a filter waits for nothing
    yield Finding(
        "delay",
        f"sightings come {1e3 * abs(found.value):.0f} ms {late} against odometry{told}",
        f"+- {1e3 * found.error:.0f} ms; log-likelihood {gain:.0f} higher than as told; odometry's rows are "
        f"{1e3 * drive.row_s:.0f} ms apart",
        f"--set sighting_delay_us={whole_us}" if whole_us >= 0 else shift,
        {"delay_s": found.value, "error": found.error, "log_likelihood_gain": gain},
        Picture(
            "delay, s",
            "what odometry leaves unexplained",
            [Curve("by moments", DELAYS_S, flow.spreads, True)],
        ),
        is_note=abs(found.value) <= limit_s,
    )


def scales(solution: Solution, drive: Drive, flow: Flow) -> Iterator[Finding]:
    """Way and turn against the sightings; the size against beacons.csv, else against truth.csv."""
    placed = next(iter(solution.references), None)
    unit = 1.0 if placed is None else _unit_of(placed.scale)
    size, by = (1.0, "the ranges alone") if placed is None else (placed.scale / unit, placed.what)
    usual = (_WAY_OFF_COMMANDED, _TURN_OFF_COMMANDED) if drive.is_commanded else (_WAY_OFF, _TURN_OFF)
    way, turn = solution.way, solution.turn
    if abs(way.value - flow.way) < _AGREE * abs(flow.way):
        limit = usual[0] + way.cover + (_SIZE_UNKNOWN if placed is None else 0.0)
        own = Estimate(size * way.value, way.error)
        picture = _sums_picture(solution, 0, "way, m")
        for one in _scale("forward_scale", "way", own, drive.scales[0], limit, by, picture):
            yield one if placed is not None else _or_distances(one, own.value)
    if abs(turn.value - flow.turn) < _AGREE * abs(flow.turn):
        nearer = min((turn.value, flow.turn), key=lambda one: abs(one - 1.0))
        own, picture = Estimate(nearer, turn.error), _sums_picture(solution, 1, "turn, rad")
        limit = usual[1] + turn.cover
        yield from _scale("turn_scale", "turn", own, drive.scales[1], limit, "bearings", picture)
    if placed is not None and abs(placed.scale - 1.0) > _SIZE_OFF:
        yield _size(placed, unit)


def _size(placed: Fitted, unit: float) -> Finding:
    """A map or path of another size than the reference; a truth that is in the same unit is believed."""
    file, scale, is_map = placed.what, placed.scale, len(placed.names) > 0
    factor = scale if unit == 1.0 else unit
    what = f"{file} is {scale:.4g} times as large as the {'map' if is_map else 'path'} that the ranges make"
    sure = f"by the places of {len(placed.names)} beacons" if is_map else f"by {len(placed.reference)} poses"
    mend = f"multiply x_m and y_m of {file} by {1.0 / factor:.4g}, or other lengths by {factor:.4g}"
    if unit == 1.0 and not is_map:
        side = "long" if scale < 1.0 else "short"
        what, sure = f"distances of sightings are {100.0 * abs(1.0 / scale - 1.0):.1f} % too {side}", what
        mend = f"multiply range_m of sightings.csv, or the sizes of the things seen, by {scale:.4g}"
    kind = "scale" if unit == 1.0 else "units"
    return Finding(kind, what, sure, mend, {"scale": scale}, _map_picture(placed, 1.0 / scale))


def _or_distances(one: Finding, way: float) -> Finding:
    """The same where nothing tells whether odometry or the distances have the right size."""
    side = "long" if way > 1.0 else "short"
    what = f"{one.what}, or distances of sightings are {100.0 * abs(way - 1.0):.1f} % too {side}"
    mend = f"{one.mend}; or multiply range_m of sightings.csv, or the sizes of the things, by {1.0 / way:.3f}"
    return replace(one, what=what, sure=f"{one.sure}; no beacons.csv or truth.csv tells which", mend=mend)


def _unit_of(scale: float) -> float:
    """What beacons.csv is larger by if it is in another unit than the rest; 1 if not."""
    if not is_gross(scale):
        return 1.0
    return min(
        (*UNITS.values(), *(1.0 / one for one in UNITS.values())), key=lambda one: abs(math.log(scale / one))
    )


def _sums_picture(solution: Solution, column: int, label: str) -> Picture:
    """Way or turn by odometry, and as the fit has it, summed up without their signs."""
    problem, state = solution.problem, solution.state
    measured = np.diff(problem.drive.odometry.sums(problem.frame_s - state.parameters[DELAY]), axis=0)
    fitted = relative(state.poses[:-1], state.poses[1:])[:, [0, 2]]
    signs = np.sign(measured[:, column])
    curves = [
        Curve(name, problem.frame_s[1:], np.cumsum(signs * of[:, column]), True)
        for name, of in (("odometry", measured), ("sightings", fitted))
    ]
    return Picture("time, s", label, curves)


def _scale(
    setting: str, what: str, one: Estimate, told: float, limit: float, by: str, picture: Picture
) -> Iterator[Finding]:
    """told: the setting as it is, which odometry has already."""
    off, error = abs(1.0 / one.value - 1.0), abs(one.value - 1.0)
    whole = Estimate(told * one.value, told * one.error)
    if error > max(_WORTH_A_NOTE, _SURE * one.error):
        yield Finding(
            "scale",
            f"odometry's {what} is {100.0 * off:.1f} % too {'long' if one.value < 1.0 else 'short'}",
            f"{setting} {whole.text} by {by}; {100.0 * limit:.1f} % are usual or covered by the told noise",
            f"--set {setting}={whole.value:.3f}",
            {setting: whole.value, "error": whole.error, "limit": limit},
            picture,
            is_note=error <= limit,
        )


def mount(solution: Solution, drive: Drive) -> Iterator[Finding]:
    """One wheel against the other, and the sensor's direction."""
    bend, yaw, base_m = solution.bend, solution.yaw, drive.robot.wheelbase_m
    wheel = bend.value * base_m
    limit = max(_WHEEL_OFF + bend.cover * base_m, _SURE * bend.error * base_m)
    if limit < abs(wheel) < 1.0 and not solution.has_one_curvature:
        more, less = ("right", "left") if wheel < 0.0 else ("left", "right")
        yield Finding(
            "scale",
            f"odometry's {more} wheel goes {100.0 * abs(wheel):.1f} % too far against the {less} one",
            f"each metre turns the robot by {bend.text} rad more than odometry has",
            f"multiply {more}_radius_m of robot.toml, or the {more} column, by {1.0 - abs(wheel):.3f}",
            {"wheel": wheel, "error": bend.error * base_m},
            _sums_picture(solution, 1, "turn, rad"),
        )
    side = "left" if yaw.value > 0.0 else "right"
    if abs(yaw.value) > max(_YAW_OFF_RAD + yaw.cover, _SURE * yaw.error):
        yield Finding(
            "mount",
            f"the sensor looks {math.degrees(abs(yaw.value)):.1f} deg more to the {side}",
            f"{yaw.text} rad beyond what is told",
            f"sensor_yaw_rad = {drive.robot.sensor_yaw_rad + yaw.value:.3f} in robot.toml",
            {"yaw_rad": yaw.value, "error": yaw.error},
        )


def wheels(solution: Solution, drive: Drive) -> Iterator[Finding]:
    """Noise of odometry that is told to have none."""
    if drive.is_commanded or not drive.is_exact:
        return
    problem = solution.problem
    turn_sd = solution.state.scale[3] * problem.step_sd[:, 2]
    per_speed = math.sqrt(2.0 * drive.row_s) / drive.robot.wheelbase_m
    sigma_mps = float(np.median(turn_sd / np.sqrt(np.diff(problem.frame_s)))) / per_speed
    if sigma_mps > _EXACT_MPS:
        yield Finding(
            "noise",
            "odometry is told to have no noise, and errs",
            f"its turn scatters as by {sigma_mps:.2g} m/s of each wheel",
            f"wheel_speed_sigma_mps = {sigma_mps:.2g} in robot.toml",
            {"sigma_mps": sigma_mps},
        )


def noise(solution: Solution, drive: Drive) -> Iterator[Finding]:
    """Of sightings, against what is told."""
    settings = ("bearing_sigma_rad", "range_sigma_fraction and range_sigma_floor_m")
    told_sd = np.median(drive.seen.told_sd, axis=0).tolist()
    zeros = zip(("bearing_sigma_rad", "range_sigma_floor_m"), told_sd, LEAST_SD, strict=True)
    rows = zip(("bearings", "ranges"), solution.noise, settings, zeros, strict=True)
    for what, one, keys, (key, sd, least) in rows:
        factor = max(one.single, one.block, 1e-3)
        is_small = one.single > _SINGLE or one.block > _BLOCK
        if is_small or factor < _CAUTIOUS:
            times = f"{factor:.1f} times more" if is_small else f"{1.0 / factor:.0f} times less"
            mend = f"multiply {keys} of robot.toml, or the sd columns of sightings.csv, by {factor:.2g}"
            if is_small and sd <= least:
                mend = f"{key} = {factor * sd:.2g} in robot.toml; none is told"
            yield Finding(
                "noise",
                f"{what} scatter {times} than is told",
                f"{one.single:.2f} of the told noise in single sightings, {one.block:.2f} in sums over 5 s; "
                f"{len(one.errors)} sightings",
                mend,
                {"single": one.single, "block": one.block},
                _histogram(one),
                is_note=not is_small,
            )


def _histogram(one: Noise) -> Picture:
    widest = max(4.0, 4.0 * one.single)
    found, edges = np.histogram(one.errors, 60, (-widest, widest), density=True)
    middle = 0.5 * (edges[1:] + edges[:-1])
    told = np.exp(-0.5 * middle**2) / math.sqrt(2.0 * math.pi)
    curves = [Curve("found", middle, found, True), Curve("told", middle, told, True)]
    return Picture("error over told noise", "density", curves)


def identities(solution: Solution, log: Log) -> Iterator[Finding]:
    """Beacons named for each other, in a part of the log or against beacons.csv."""
    found = exchanges(solution.problem, solution.state)
    for pair in dict.fromkeys(frozenset((one.named, one.shown)) for one in found):
        yield _exchange([one for one in found if {one.named, one.shown} == pair], solution, log)
    for fitted in solution.references:
        for a, b in (map(log.identity, pair) for pair in fitted.exchanged()):
            what = f"beacons {a} and {b} are exchanged between sightings.csv and {fitted.what}"
            sure, mend = (
                "each stands where the other is told; others fit",
                f"exchange {a} and {b} in {fitted.what}",
            )
            yield Finding("identities", what, sure, mend, {"labels": [a, b]}, _map_picture(fitted))


def _exchange(both: list[Exchange], solution: Solution, log: Log) -> Finding:
    """Of one pair: each for the other, or one for the other alone."""
    one, time_s = both[0], solution.problem.drive.seen.time_s
    hits_s = time_s[np.concatenate([each.hits for each in both])]
    own_m, other_m = (
        float(np.median(np.concatenate([off[np.isin(each.rows, each.hits)] for each, off in pairs])))
        for pairs in ([(each, each.own_m) for each in both], [(each, each.other_m) for each in both])
    )
    count, of = sum(len(each.hits) for each in both), sum(each.inside for each in both)
    a, b = log.identity(one.named), log.identity(one.shown)
    are = f"{a} and {b} are exchanged" if len(both) > 1 else f"{b} are named {a}"
    curves = [
        Curve(f"named {a}, from where {label} is", time_s[one.rows], off_m)
        for label, off_m in ((a, one.own_m), (b, one.other_m))
    ]
    return Finding(
        "identities",
        f"sightings of beacons {are} from {hits_s.min():.1f} to {hits_s.max():.1f} s of odometry",
        f"{count} of {of} are off by {own_m:.2f} m as they are named, by {other_m:.2f} m if exchanged",
        "exchange these beacon_id in sightings.csv",
        {"labels": [a, b], "from_s": hits_s.min(), "until_s": hits_s.max(), "sightings": count},
        Picture("time, s", "distance, m", curves),
    )


def _map_picture(fitted: Fitted, size: float = 1.0) -> Picture:
    """The estimate, grown about the middle, and the reference; size: one that undoes the alignment's."""
    middle = np.mean(fitted.reference)
    estimate = middle + size * (fitted.estimate - middle)
    pairs = (("map" if len(fitted.names) else "path", estimate), (fitted.what, fitted.reference))
    return Picture("x, m", "y, m", [Curve(label, points.real, points.imag) for label, points in pairs])
