"""Feed a log to any algorithm (`bslam.algorithms`), and keep what it says."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.algorithms import Algorithm, Landmark, Setup, Sighting
from bslam.errors import BslamError
from bslam.evaluation.ledger import Ledger
from bslam.evaluation.trace import MapBeacon, SightingCounts, Trace
from bslam.evaluation.truth import gyro_rates, step_times_us, wheel_travel
from bslam.log import Log
from bslam.options import RunOptions, core_params
from bslam.runs.runner import MAPPABLE, Frames, beacons_to_hold

STANDS_FOR_M = 1.0
"""A landmark without a label stands for the true beacon nearest to it, if that is nearer than this."""

_ROUNDING = 1e-3
"""Of a correlation: so little below 0, or uneven, is a filter's rounding."""


class AlgorithmError(BslamError):
    """An algorithm said something that cannot be: which call, at which step, and what is allowed."""


def run_algorithm(
    log: Log, options: RunOptions, make: Callable[[Setup], Algorithm], alive: Callable[[int], None]
) -> Trace:
    """Run it over the log; `alive` hears of every step that is done.

    Raises what the algorithm raises, with the step as a note, and AlgorithmError for a pose or map that is
    not finite.
    """
    algorithm = make(setup_for(log, options))
    if getattr(algorithm, "needs_identity", False) and options.association != "known":
        options = replace(options, association="known", wrong_identity_rate=0.0)
        algorithm = make(setup_for(log, options))
    return _Drive(algorithm, log, options, alive).finish()


def setup_for(log: Log, options: RunOptions) -> Setup:
    """What an algorithm is told before this drive."""
    return Setup(
        robot=log.robot,
        observation=options.observation,
        identities=options.association == "known",
        beacons_max=beacons_to_hold(log, options),
        parameters=core_params(options, log),
        real=options.real,
        seeds=log.seeds,
    )


class _Drive:
    """One pass over a log."""

    def __init__(
        self, algorithm: Algorithm, log: Log, options: RunOptions, alive: Callable[[int], None]
    ) -> None:
        self._algorithm = algorithm
        self._log = log
        self._frames = Frames(log.sightings, options)
        self._poses: list[tuple[float, float, float]] = []
        self._covariances: list[NDArray[np.float64]] = []
        self._seen: list[bool] = []
        self._sightings = 0
        self._tells = hasattr(algorithm, "accounts") and hasattr(algorithm, "uids")
        self._ledger = Ledger(getattr(algorithm, "uids", tuple))
        self._step_ns: list[int] = []
        self._times_us: list[int] = step_times_us(log).tolist()
        algorithm.reset(options.seed)
        try:
            self._run(alive)
        except AlgorithmError:
            raise
        except Exception as error:  # anything: it is a stranger's code
            error.add_note(self._where(error))
            raise

    def _where(self, error: Exception) -> str:
        """Step, call and time of the step in which the algorithm raised."""
        step = len(self._poses)
        frames = traceback.extract_tb(error.__traceback__)
        call = next((one.name for one in frames if one.filename != __file__), "call")
        return f"at step {step} ({call}, time_us {self._times_us[step]})"

    def _run(self, alive: Callable[[int], None]) -> None:
        algorithm, clock, times_us = self._algorithm, time.thread_time_ns, self._times_us
        self._observe_start(times_us)
        self._keep(0)
        travel = zip(
            *(one.tolist() for one in (*wheel_travel(self._log), *gyro_rates(self._log))), strict=True
        )
        feel = getattr(algorithm, "gyro", None)
        for step, (left_m, right_m, rate_radps, sd_radps) in enumerate(travel, start=1):
            began = clock()
            if feel is not None and not math.isnan(rate_radps):
                feel(times_us[step], rate_radps, sd_radps)
            algorithm.odometry(times_us[step], left_m, right_m)
            self._observe_until(times_us[step] if step + 1 < len(times_us) else None)
            self._keep(step)
            self._step_ns.append(clock() - began)
            alive(step)

    def _observe_start(self, times_us: list[int]) -> None:
        """What is seen before the first move; an empty image if nothing is, so that all know the time."""
        while self._frames.waiting_before(times_us[0]):
            self._frames.take()  # from before the drive
        if not self._frames.waiting_before(times_us[0] + 1):
            self._algorithm.observe(times_us[0], [])
        self._observe_until(times_us[0] if len(times_us) > 1 else None)

    def _observe_until(self, until_us: int | None) -> None:
        """What was seen up to then; None: all that is left."""
        seen = False
        while self._frames.waiting_before(None if until_us is None else until_us + 1):
            seen = True
            time_us, true_id, columns = self._frames.take()
            sightings = _as_sightings(columns)
            self._sightings += len(sightings)
            self._algorithm.observe(time_us, sightings)
            if self._tells:
                self._book(true_id, columns[MAPPABLE])
        self._seen.append(seen)

    def _book(self, true_id: Sequence[int], mappable: Sequence[bool]) -> None:
        algorithm: Any = self._algorithm
        accounts = algorithm.accounts()
        if accounts is None:
            self._ledger.book_refused(true_id, mappable)
        elif len(accounts) != len(true_id):
            raise AlgorithmError(
                f"accounts() returned {len(accounts)}; allowed: one for each of {len(true_id)}"
            )
        else:
            self._ledger.book(true_id, mappable, accounts)

    def _keep(self, step: int) -> None:
        pose = self._algorithm.pose()
        try:
            x_m, y_m, theta_rad = (float(one) for one in pose)
        except (TypeError, ValueError):
            raise AlgorithmError(
                f"pose() returned {pose!r} at step {step}; allowed: three numbers, x_m, y_m, theta_rad"
            ) from None
        if not (math.isfinite(x_m) and math.isfinite(y_m) and math.isfinite(theta_rad)):
            raise AlgorithmError(f"pose() returned {pose!r} at step {step}; allowed: finite numbers")
        self._poses.append((x_m, y_m, math.remainder(theta_rad, math.tau)))
        covariance: Any = getattr(self._algorithm, "pose_covariance", lambda: np.full((3, 3), np.nan))()
        if np.shape(covariance) != (3, 3):
            raise AlgorithmError(
                f"pose_covariance() returned shape {np.shape(covariance)} at step {step}; allowed: (3, 3)"
            )
        self._covariances.append(covariance)

    def finish(self) -> Trace:
        """The trace of the drive."""
        covariance = np.array(self._covariances, dtype=np.float64)
        _require_covariances(covariance)
        return Trace(
            time_us=np.array(self._times_us, dtype=np.int64),
            pose=np.array(self._poses, dtype=np.float64),
            covariance=covariance,
            seen=np.array(self._seen, dtype=np.bool_),
            counts=self._ledger.counts() if self._tells else SightingCounts(self._sightings, told=False),
            beacons=tuple(self._map()),
            parameters={},
            step_us_median=float(np.median(self._step_ns)) * 1e-3 if self._step_ns else 0.0,
        )

    def _map(self) -> Iterable[MapBeacon]:
        landmarks: Any = self._algorithm.map()
        if not isinstance(landmarks, Iterable):
            raise AlgorithmError(f"map() returned {landmarks!r}; allowed: a list of Landmark")
        for number, landmark in enumerate(landmarks):
            if not isinstance(landmark, Landmark):
                raise AlgorithmError(f"map() returned {landmark!r}; allowed: Landmark, of bslam.algorithms")
            place = (float(landmark.x_m), float(landmark.y_m))
            if not all(map(math.isfinite, place)):
                raise AlgorithmError(f"map() returned {landmark!r}; allowed: finite places")
            yield self._as_beacon(number, landmark, *place)

    def _as_beacon(self, number: int, landmark: Landmark, x_m: float, y_m: float) -> MapBeacon:
        covariance = landmark.covariance_m2
        return MapBeacon(
            uid=number,
            label=-1 if landmark.label is None else landmark.label,
            true_id=self._identity(landmark, x_m, y_m),
            x_m=x_m,
            y_m=y_m,
            covariance_m2=np.full((2, 2), np.nan) if covariance is None else np.asarray(covariance),
            sightings=0,
            confirmed=True,
            range_m=math.hypot(x_m, y_m),
            phi_rad=math.atan2(y_m, x_m),
        )

    def _identity(self, landmark: Landmark, x_m: float, y_m: float) -> int:
        if landmark.label is not None:
            return landmark.label
        return self._ledger.identity(landmark.uid) if landmark.uid is not None else self._stands_for(x_m, y_m)

    def _stands_for(self, x_m: float, y_m: float) -> int:
        beacons = self._log.beacons
        if beacons is None or len(beacons.beacon_id) == 0:
            return -1
        distance_m = np.hypot(beacons.x_m - x_m, beacons.y_m - y_m)
        nearest = int(np.argmin(distance_m))
        return int(beacons.beacon_id[nearest]) if distance_m[nearest] < STANDS_FOR_M else -1


def _require_covariances(covariance: NDArray[np.float64]) -> None:
    """Raise AlgorithmError for the first (n, 3, 3) that is none, beyond rounding; NaN says nothing."""
    sd = np.sqrt(np.abs(np.diagonal(covariance, axis1=1, axis2=2)))
    sd[sd == 0.0] = 1.0
    scaled = covariance / (sd[:, :, None] * sd[:, None, :])
    rows = np.flatnonzero(np.isfinite(scaled).all(axis=(1, 2)))
    uneven = np.abs(scaled[rows] - scaled[rows].transpose(0, 2, 1)).max(axis=(1, 2))
    bad = rows[(uneven > _ROUNDING) | (np.linalg.eigvalsh(scaled[rows])[:, 0] < -_ROUNDING)]
    if len(bad):
        said = f"pose_covariance() returned {covariance[bad[0]].tolist()} at step {bad[0]}"
        raise AlgorithmError(f"{said}; allowed: a symmetric matrix without an eigenvalue below 0")


def _as_sightings(columns: list[Any]) -> list[Sighting]:
    """The columns of a frame (`runner.columns_for_filter`) as objects; what is not known as None."""
    bearing_rad, range_m, label, mappable = columns[:4]
    nothing = [None] * len(bearing_rad)
    bearing_sd, range_sd, scale_sd, signature, kind, score = (
        nothing if len(columns) <= at or columns[at] is None else columns[at] for at in range(4, 10)
    )
    return [
        Sighting(
            bearing_rad=bearing,
            range_m=None if math.isnan(distance) else distance,
            label=None if identity < 0 else identity,
            mappable=use,
            bearing_sd_rad=sd_rad or None,
            range_sd_m=sd_m or None,
            range_scale_sd=alike or None,
            signature=look,
            beacon_class=told or None,
            score=sure or None,
        )
        for bearing, distance, identity, use, sd_rad, sd_m, alike, look, told, sure in zip(
            bearing_rad,
            range_m,
            label,
            mappable,
            bearing_sd,
            range_sd,
            scale_sd,
            signature,
            kind,
            score,
            strict=True,
        )
    ]
