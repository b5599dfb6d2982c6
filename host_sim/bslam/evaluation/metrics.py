"""How good a run was: the errors step by step, and the figures of `summary.json`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import Points, Rigid, fit, fit_rigid, fit_scale
from bslam.evaluation.bound import has_bound, mean_bound_m
from bslam.evaluation.consistency import POSE_95, nees
from bslam.evaluation.failure import NEES_MAX, is_exact, map_one_to_one, was_off
from bslam.evaluation.nameless import lay_over, nearest_of
from bslam.evaluation.relative import relative_pose_error
from bslam.evaluation.remarks import notes_on, problems_of
from bslam.evaluation.trace import MapBeacon, SightingCounts, Trace
from bslam.evaluation.truth import (
    dead_reckoning,
    is_dense,
    odometry_increments,
    starts_at_origin,
    truth_at,
)
from bslam.log import Log, has_identities
from bslam.options import RunOptions, presets_of, recovery_of, uses_velocity_states, wheel_noise

WINDOW_S: Final = 50.0  # "first" and "last" 50 s
NEES_FIRST_STEP: Final = 51  # by then the pose covariance has left its start value of 0
DIVERGED_ERROR_M: Final = 2.0
DIVERGED_STEPS: Final = 1000  # at the end of the run
_NEES_ABSURD: Final = 1e4  # errors 60 times as large as claimed
BEACON_SIGHTINGS: Final = 4  # a true beacon counts if it was sighted at least so often


@dataclass(frozen=True)
class Evaluation:
    """A run held against the truth; rows as in the trace, NaN where nothing is known: of a log with nothing
    but true beacons, in every row.
    """

    time_s: NDArray[np.float64]  # (n + 1,) since the start
    truth: NDArray[np.float64]  # (n + 1, 3) true poses, frame of the truth
    estimate: NDArray[np.float64]  # (n + 1, 3) estimated poses, brought into the frame of the truth
    error_m: NDArray[
        np.float64
    ]  # (n + 1,) distance of the two; NaN at the start, where it is 0 by definition
    nees: NDArray[np.float64]  # (n + 1,) of the pose; NaN before step 51
    dead_reckoning_error_m: NDArray[np.float64]  # (n + 1,)
    align: str  # how the estimate was brought there: "none", "rigid", "similarity"
    map_align: str  # the same of the map
    to_truth: Rigid  # map frame -> frame of the truth, by the path; where none is known, by the beacons
    map_to_truth: Rigid  # the same by the beacons: they are judged by their own alignment


def evaluate(log: Log, trace: Trace, options: RunOptions) -> Evaluation | None:
    """Errors of a run; None if the log has neither truth nor true beacons.

    The estimate is aligned as the options say; else not at all where the truth starts at the robot, and
    rigidly where it has a frame of its own. The map's alignment is its own, and may be of another kind.
    """
    if log.truth is None and log.beacons is None:
        return None
    align = options.align or ("none" if starts_at_origin(log) else "rigid")
    map_align = options.align or options.map_align or align
    truth, known = np.full_like(trace.pose, np.nan), np.zeros(len(trace.pose), dtype=np.bool_)
    if log.truth is not None:
        truth, known = truth_at(log.truth, trace.time_us)
    scored = known.copy()
    scored[0] = False
    by_path = fit(align, trace.pose[scored, :2], truth[scored, :2])
    by_map = _fit_map(map_align, log, trace, by_path if scored.sum() > 1 else None)
    to_truth = by_path if log.truth is not None else by_map
    estimate = to_truth.poses(trace.pose)
    alone = _odometry_alone(log, trace)
    alone = fit(align, alone[scored, :2], truth[scored, :2]).poses(alone)
    return Evaluation(
        time_s=trace.time_s,
        truth=truth,
        estimate=estimate,
        error_m=np.where(scored, _distance(estimate, truth), np.nan),
        nees=_nees(trace, to_truth.inverse().poses(truth), scored, options),
        dead_reckoning_error_m=np.where(scored, _distance(alone, truth), np.nan),
        align=align,
        map_align=map_align,
        to_truth=to_truth,
        map_to_truth=by_map,
    )


def summarise(log: Log, trace: Trace, options: RunOptions, evaluation: Evaluation | None) -> dict[str, Any]:
    """The entry of a run in `summary.json`. A figure that the log cannot give (no truth, say) is left out."""
    entry = describe(options, log) | {
        "scenario": log.name,
        "parameters": trace.parameters,
        "steps": trace.steps,
        "path_m": _path_m(log, evaluation),
        "seen_any_share": float(np.mean(trace.seen[1:])) if trace.steps else 0.0,
        "beacons_mapped": sum(beacon.confirmed for beacon in trace.beacons),
        **_count_figures(log, trace.counts),
        "refused_inputs": sum(trace.refusals.values()),
        "counters": trace.counters,
        "diverged": not np.isfinite(trace.pose).all(),
    }
    if trace.target:
        entry["target_image"] = trace.target
    else:
        entry["step_us_median"] = trace.step_us_median
    if log.beacons is not None and has_identities(log):
        entry["beacons_true"] = int(_often_sighted(log).sum())
    if evaluation is not None:
        entry |= {"align": evaluation.align, "map_align": evaluation.map_align}
        entry |= _position_figures(evaluation)
        entry |= _relative_figures(log, trace, evaluation)
        entry |= _map_figures(log, trace, evaluation)
        if options.observation == "direction" and evaluation.align != "none":
            entry |= _scaled_figures(log, trace, evaluation)
        if has_bound(log, options) and np.isfinite(evaluation.truth).all():
            entry["bound_error_m"] = mean_bound_m(log, trace.time_us, evaluation.truth)
        entry["diverged"] = bool(entry["diverged"] or _is_lost(evaluation))
        if log.beacons is not None and has_identities(log):
            entry["map_one_to_one"] = _map_one_to_one(log, trace, evaluation)
    entry["failed_by"] = _failures(entry, evaluation)
    entry["failed"] = bool(entry["failed_by"])
    notes = notes_on(log, trace, options) + (_of_nees(trace, evaluation) if evaluation else [])
    return entry | {"notes": notes, "problems": problems_of(log, trace, options)}


def _failures(entry: dict[str, Any], evaluation: Evaluation | None) -> list[str]:
    """Why a run failed, without another one beside it."""
    failures = ["diverged"] if entry["diverged"] else []
    if "map_one_to_one" in entry and not is_exact(entry["map_one_to_one"]):
        failures.append("map")
    if evaluation is not None:
        if was_off(evaluation.time_s, evaluation.error_m):
            failures.append("off")
        last = evaluation.nees[_last_window(evaluation)]
        if np.isfinite(last).any() and np.nanmean(last) > NEES_MAX:
            failures.append("nees")
    return failures


_BY_IDENTITY: Final = ("wrong_associations", "false_new", "missed")
"""Counts that rest on the true identity of each sighting."""


def _count_figures(log: Log, counts: SightingCounts) -> dict[str, int]:
    figures = asdict(counts)
    if not figures.pop("told"):
        return {"sightings": counts.sightings}
    return {name: one for name, one in figures.items() if has_identities(log) or name not in _BY_IDENTITY}


def describe(options: RunOptions, log: Log | None = None) -> dict[str, Any]:
    """What was run, in the words of the command line; without the log, as far as the options say."""
    sigma_mps, velocity_states, noise = options.sigma_mps, options.velocity_states, options.noise
    presets = options.presets or None
    if log is not None:
        presets = presets_of(options, log)
        sigma_mps = log.robot.wheel_speed_sigma_mps if sigma_mps is None else sigma_mps
        velocity_states = uses_velocity_states(options, log)
        noise = wheel_noise(options, log)
    words = {
        "seed": options.seed,
        "presets": presets,
        "sigma_mps": sigma_mps,
        "sensor": options.sensor,
        "rig": options.rig,
        "observation": options.observation,
        "association": options.association_name,
        "filter": options.filter,
        "motion": options.motion,
        "velocity_states": velocity_states,
        "noise": noise,
        "target": options.target,
        "real": options.real,
        "known_map": options.known_map,
        "kept_map": options.kept_map,
        "frozen": options.frozen or None,
        "recovery": recovery_of(options),
        "align": options.align,
    }
    return {word: value for word, value in words.items() if value is not None}


def map_pairs(
    log: Log, trace: Trace, to_truth: Rigid | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Confirmed beacons and the true ones they stand for, (b, 2) m each; a duplicate counts twice.

    Where no sighting has an identity, each stands for the true one nearest to it by `to_truth`.
    """
    if log.beacons is None or len(log.beacons.x_m) == 0:
        return np.empty((0, 2)), np.empty((0, 2))
    mapped = [one for one in trace.beacons if one.confirmed]
    true_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    if not has_identities(log):
        mapped_m = _places_m(mapped)
        near = nearest_of((to_truth or Rigid()).points(mapped_m), true_m)
        return mapped_m, true_m[near]
    row_of = {identity: row for row, identity in enumerate(log.beacons.beacon_id.tolist())}
    mapped = [one for one in mapped if one.true_id in row_of]
    return _places_m(mapped), true_m[[row_of[one.true_id] for one in mapped]]


def _places_m(beacons: Sequence[MapBeacon]) -> Points:
    return np.array([(one.x_m, one.y_m) for one in beacons], dtype=np.float64).reshape(-1, 2)


def _fit_map(align: str, log: Log, trace: Trace, by_path: Rigid | None) -> Rigid:
    if has_identities(log) or log.beacons is None:
        return fit(align, *map_pairs(log, trace))
    true_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    return lay_over(align, _places_m([one for one in trace.beacons if one.confirmed]), true_m, by_path)


def _odometry_alone(log: Log, trace: Trace) -> NDArray[np.float64]:
    scales = (float(trace.parameters.get(name, 1.0)) for name in ("forward_scale", "turn_scale"))
    return dead_reckoning(log, *scales)


def _distance(poses: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(poses[:, 0] - truth[:, 0], poses[:, 1] - truth[:, 1])


def _nees(
    trace: Trace, truth: NDArray[np.float64], scored: NDArray[np.bool_], options: RunOptions
) -> NDArray[np.float64]:
    """NEES of the rows that have one; `truth` in the map frame, where the filter keeps its error."""
    rows = scored.copy()
    rows[:NEES_FIRST_STEP] = False
    rows &= np.isfinite(trace.covariance).all(axis=(1, 2))  # not every algorithm says how sure it is
    rows &= np.isfinite(truth[:, 2])
    result = np.full(len(rows), np.nan)
    result[rows] = nees(trace.pose[rows], truth[rows], trace.covariance[rows], options.filter)
    return result


def _of_nees(trace: Trace, evaluation: Evaluation) -> list[str]:
    """Notes where NEES is beyond all measure, or of the alignment."""
    known = evaluation.nees[np.isfinite(evaluation.nees)]
    mean = float(known.mean()) if len(known) else 0.0
    early = _of_early_nees(trace, evaluation)
    if early or mean < _NEES_ABSURD:
        return early
    return [f"NEES {mean:.3g} for 3: the filter is sure of what is wrong; is the noise that it is told 0?"]


def _of_early_nees(trace: Trace, evaluation: Evaluation) -> list[str]:
    """A note where NEES is of the alignment, and not of the filter.

    At the start the estimate is exact by definition, so that what it is off there is the alignment's error.
    While the filter is surer than that, NEES measures the alignment.
    """
    off_m = float(_distance(evaluation.estimate[:1], evaluation.truth[:1])[0])
    if evaluation.align == "none" or not np.isfinite(off_m):
        return []
    position_sd_m = np.sqrt(trace.covariance[:, 0, 0] + trace.covariance[:, 1, 1])
    early = np.logical_and.accumulate(position_sd_m < off_m)
    known = np.isfinite(evaluation.nees)
    if not (known & ~early).any():
        return []
    whole, later = float(evaluation.nees[known].mean()), float(evaluation.nees[known & ~early].mean())
    if whole < POSE_95 or later > 0.5 * whole:
        return []
    until_s = float(evaluation.time_s[early][-1])
    return [
        f"NEES {whole:.1f} comes from the first {until_s:.1f} s, where the filter is surer than the "
        f"alignment, {100.0 * off_m:.1f} cm off at the start; afterwards {later:.1f}"
    ]


def _path_m(log: Log, evaluation: Evaluation | None) -> float:
    """Length of the true path; of the measured one where the truth has long gaps."""
    if log.truth is None or evaluation is None or not is_dense(log.truth):
        return float(np.sum(np.abs(odometry_increments(log)[0])))
    known = evaluation.truth[np.isfinite(evaluation.truth[:, 0]), :2]
    return float(np.sum(np.hypot(*np.diff(known, axis=0).T)))


def _often_sighted(log: Log) -> NDArray[np.bool_]:
    """Which of the true beacons count, (t,)."""
    assert log.beacons is not None
    sighted = log.sightings.beacon_id[log.sightings.mappable]
    counts = np.sum(sighted[:, None] == log.beacons.beacon_id[None, :], axis=0)
    result: NDArray[np.bool_] = counts >= BEACON_SIGHTINGS
    return result


def _map_one_to_one(log: Log, trace: Trace, evaluation: Evaluation) -> dict[str, int]:
    """Of the beacons whose true place somebody knows, and of clutter that was taken for one."""
    assert log.beacons is not None
    judged = {-1, *log.beacons.beacon_id.tolist()}
    confirmed_m = _places_m([one for one in trace.beacons if one.confirmed and one.true_id in judged])
    true_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    return map_one_to_one(evaluation.map_to_truth.points(confirmed_m), true_m, _often_sighted(log))


def _last_window(evaluation: Evaluation) -> NDArray[np.bool_]:
    late: NDArray[np.bool_] = evaluation.time_s > evaluation.time_s[-1] - WINDOW_S
    return late


def _position_figures(evaluation: Evaluation) -> dict[str, Any]:
    error_m, time_s = evaluation.error_m, evaluation.time_s
    figures: dict[str, Any] = {}
    if np.isfinite(error_m).any():
        figures["position_error_m"] = {
            "mean": float(np.nanmean(error_m)),
            "max": float(np.nanmax(error_m)),
            "min": float(np.nanmin(error_m)),
            "std": float(np.nanstd(error_m)),
            "rmse": float(np.sqrt(np.nanmean(error_m**2))),
        }
    figures |= _mean_if_any("position_error_first_50s_m", error_m[time_s <= WINDOW_S])
    figures |= _mean_if_any("position_error_last_50s_m", error_m[_last_window(evaluation)])
    figures |= _mean_if_any("dead_reckoning_error_m", evaluation.dead_reckoning_error_m)
    figures |= _mean_if_any("nees_mean", evaluation.nees)
    inside = np.where(np.isfinite(evaluation.nees), evaluation.nees < POSE_95, np.nan)
    return figures | _mean_if_any("nees_inside_95", inside)


def _relative_figures(log: Log, trace: Trace, evaluation: Evaluation) -> dict[str, dict[str, float]]:
    """Of poses as they stand in the map frame: no alignment changes a rigid motion between two of them."""
    if log.truth is None or not is_dense(log.truth):
        return {}
    paths = {
        "relative_pose_error": trace.pose,
        "dead_reckoning_relative_pose_error": _odometry_alone(log, trace),
    }
    figures = {name: relative_pose_error(poses, evaluation.truth) for name, poses in paths.items()}
    return {name: ones for name, ones in figures.items() if ones}


def _mean_if_any(name: str, values: NDArray[np.float64]) -> dict[str, float]:
    finite = values[np.isfinite(values)]
    return {name: float(np.mean(finite))} if len(finite) else {}


def _map_figures(log: Log, trace: Trace, evaluation: Evaluation) -> dict[str, float]:
    mapped_m, true_m = map_pairs(log, trace, evaluation.map_to_truth)
    if len(mapped_m) == 0:
        return {}
    distance_m = _distance(evaluation.map_to_truth.points(mapped_m), true_m)
    return {"map_rmse_m": float(np.sqrt(np.mean(distance_m**2)))}


def _scaled_figures(log: Log, trace: Trace, evaluation: Evaluation) -> dict[str, float]:
    """What is left of path and map if the scale, which directions leave to odometry, is fitted, too."""
    known = np.isfinite(evaluation.error_m)
    mapped_m, true_m = map_pairs(log, trace, evaluation.map_to_truth)
    figures = {}
    for name, moving_m, fixed_m in (
        ("position", trace.pose[known, :2], evaluation.truth[known, :2]),
        ("map", mapped_m, true_m),
    ):
        if len(moving_m) > 1:
            scale = fit_scale(moving_m, fixed_m)
            off_m = fit_rigid(scale * moving_m, fixed_m).points(scale * moving_m) - fixed_m
            figures[f"{name}_scale"] = scale
            figures[f"{name}_rmse_scaled_m"] = float(np.sqrt(np.mean(np.sum(off_m**2, axis=1))))
    return figures


def _is_lost(evaluation: Evaluation) -> bool:
    error_m = evaluation.error_m[np.isfinite(evaluation.error_m)]
    return bool(np.any(error_m[-DIVERGED_STEPS:] > DIVERGED_ERROR_M))
