"""What does not change while a run goes on, for whoever shows it."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bslam.evaluation.align import Points, Rigid
from bslam.evaluation.truth import dead_reckoning, starts_at_origin, step_times_us, truth_at
from bslam.log import Log
from bslam.moment import Stage
from bslam.runs.batch import Job

_MARGIN_M: Final = 0.9


def stage_of(job: Job, log: Log) -> Stage:
    """The room of this run, as much of it as is known."""
    walls_m = job.source.walls_m()
    aligned = log.truth is not None and not starts_at_origin(log)
    robot = log.robot
    beacon_id = np.empty(0, np.int64) if log.beacons is None else log.beacons.beacon_id
    points_m = np.concatenate([walls_m.reshape(-1, 2), _places_m(log)])
    low_m, high_m = np.nanmin(points_m, axis=0), np.nanmax(points_m, axis=0)
    extent_m = (*(low_m - _MARGIN_M).tolist(), *(high_m + _MARGIN_M).tolist())
    return Stage(
        title=f"{job.name}: {job.options.association_name} association, {job.options.filter} filter",
        steps=len(step_times_us(log)) - 1,
        walls_m=walls_m,
        beacon_id=beacon_id,
        beacon_name=tuple(map(log.identity, beacon_id.tolist())),
        sensor=(robot.sensor_x_m, robot.sensor_y_m, robot.sensor_yaw_rad),
        aligned=aligned,
        has_camera=job.options.sensor == "camera",
        extent_m=extent_m,
    )


def _places_m(log: Log) -> Points:
    """Where the drive will go and what it will see, map frame, (n, 2): as true as anybody knows before it."""
    path, to_map = dead_reckoning(log), None
    if log.truth is not None:
        truth, _ = truth_at(log.truth, step_times_us(log))
        if np.isfinite(truth[0]).all():
            x_m, y_m, theta_rad = truth[0].tolist()
            to_map = Rigid(theta_rad, x_m, y_m).inverse()
            path = to_map.poses(truth)
    if log.beacons is None or (log.truth is not None and to_map is None):
        places_m = _sighted_m(log, path)
    else:
        places_m = (to_map or Rigid()).points(np.column_stack([log.beacons.x_m, log.beacons.y_m]))
    return np.concatenate([np.zeros((1, 2)), path[:, :2], places_m])


def _sighted_m(log: Log, path: NDArray[np.float64]) -> Points:
    """Places of the sightings with a distance, seen from the path."""
    seen, robot = log.sightings, log.robot
    rows = np.clip(np.searchsorted(step_times_us(log), seen.time_us), 0, len(path) - 1)
    x_m, y_m, theta_rad = path[rows].T
    course_rad = theta_rad + robot.sensor_yaw_rad + seen.bearing_rad
    c, s = np.cos(theta_rad), np.sin(theta_rad)
    x_m = x_m + c * robot.sensor_x_m - s * robot.sensor_y_m + seen.range_m * np.cos(course_rad)
    y_m = y_m + s * robot.sensor_x_m + c * robot.sensor_y_m + seen.range_m * np.sin(course_rad)
    return np.column_stack([x_m, y_m])[np.isfinite(seen.range_m)]
