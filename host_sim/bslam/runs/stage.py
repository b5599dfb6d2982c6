"""What does not change while a run goes on, for whoever shows it."""

from __future__ import annotations

import numpy as np

from bslam.evaluation.truth import starts_at_origin, step_times_us
from bslam.log import Log
from bslam.moment import Stage
from bslam.runs.batch import Job


def stage_of(job: Job, log: Log) -> Stage:
    """The room of this run, as much of it as is known."""
    walls_m = job.source.walls_m()
    points = [walls_m.reshape(-1, 2), np.zeros((1, 2))]
    aligned = log.truth is not None and not starts_at_origin(log)
    if log.truth is not None and not aligned:
        points.append(np.column_stack([log.truth.x_m, log.truth.y_m]))
    if log.beacons is not None and not aligned:
        points.append(np.column_stack([log.beacons.x_m, log.beacons.y_m]))
    robot = log.robot
    beacon_id = np.empty(0, np.int64) if log.beacons is None else log.beacons.beacon_id
    low_m, high_m = np.nanmin(np.concatenate(points), axis=0), np.nanmax(np.concatenate(points), axis=0)
    margin_m = 0.9 if len(points) > 2 else 8.0  # of a log whose truth has its own frame nobody knows
    extent_m = (*(low_m - margin_m).tolist(), *(high_m + margin_m).tolist())
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
