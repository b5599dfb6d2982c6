"""Runs into the C core and into the reference; how far two estimates are apart. For the tests of the core."""

import numpy as np
from numpy.typing import NDArray

from bslam.core import Slam
from core import instance
from reference.dense_ekf import DenseEkf, Motion, motion_of_wheels
from reference.runs import STEP_S, Step, mount

KINDS: list[dict[str, float]] = [
    {"filter": invariant, "motion": motion, "velocity_states": velocity, "scale_states": scale}
    for invariant in (0, 1)
    for motion in (0, 1)
    for velocity, scale in ((0, 0), (1, 0), (0, 1))
]
"""Every form of the filter."""


def name(kind: dict[str, float]) -> str:
    """A test's name for one of KINDS: "invariant-arc-velocity"."""
    parts = ["invariant" if kind["filter"] else "standard", "arc" if kind["motion"] else "euler"]
    return "-".join(parts + [part for part in ("velocity", "scale") if kind[f"{part}_states"]])


def feed(slam: Slam, step: Step) -> None:
    """One step of a run into the C core."""
    slam.odometry("wheels", step.time_us, step.left_m, step.right_m)
    look(slam, step)


def look(slam: Slam, step: Step) -> None:
    """What is seen in a step into the C core."""
    seen = step.sightings
    ranges = [np.nan if s.range_m is None else s.range_m for s in seen]
    slam.sightings(
        step.time_us, [s.bearing_rad for s in seen], ranges, [s.label for s in seen], [True] * len(seen)
    )


def feed_reference(reference: DenseEkf, step: Step) -> None:
    """One step of a run into the reference."""
    if step.time_us > 0:
        reference.predict(motion_of_wheels(reference.params, step.left_m, step.right_m, STEP_S))
    reference.frame(step.sightings, mount(reference.params))


def part(motion: Motion, share: float) -> Motion:
    """A share of a motion at constant speeds, whose errors in one share say nothing of those in another."""
    return Motion(
        motion.dt_s * share, motion.forward_m * share, motion.turn_rad * share, motion.covariance * share
    )


def difference(a: NDArray[np.float64], b: NDArray[np.float64], angles: list[int]) -> NDArray[np.float64]:
    """a - b, angles as directions."""
    result = a - b
    result[angles] = np.remainder(result[angles] + np.pi, 2 * np.pi) - np.pi
    return result


def deviations(actual: Slam, mean: NDArray[np.float64], p: NDArray[np.float64], angles: list[int]) -> float:
    """The largest difference of any value of the mean or the covariance, in standard deviations.

    What is known better than to 1 mm or 1 mrad (exactly, as an anchor of the first frame is) counts as 1 mm
    or 1 mrad.
    """
    sd = np.sqrt(np.maximum(np.diag(p), 1e-6))
    off = np.abs(difference(instance.mean(actual), mean, angles)) / sd
    off_p = np.abs(instance.covariance(actual) - p) / np.outer(sd, sd)
    return float(max(off.max(), off_p.max()))


def deviations_between(actual: Slam, twin: Slam) -> float:
    """The same between two instances whose states have the same layout."""
    return deviations(actual, instance.mean(twin), instance.covariance(twin), instance.angles(twin))
