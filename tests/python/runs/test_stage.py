"""How much of the plane `bslam live` shows before the drive: what the drive takes, and not much more."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.align import Rigid
from bslam.log import Beacons, Truth
from bslam.options import RunOptions
from bslam.runs.batch import make_jobs
from bslam.runs.sources import FolderSource
from bslam.runs.stage import stage_of


@pytest.fixture
def extent_m(tmp_path):
    """Of a log, as the command would show it."""

    def of(log):
        log.write(tmp_path / log.name)
        (job,) = make_jobs([FolderSource(tmp_path / log.name)], [RunOptions()], None, 0)
        return stage_of(job, log).extent_m

    return of


@pytest.mark.parametrize("frame", [Rigid(), Rigid(2.0, 30.0, -7.0)])
@pytest.mark.parametrize(("has_truth", "has_beacons"), [(True, True), (True, False), (False, False)])
def test_extent_is_of_the_drive_and_of_what_is_seen(made, extent_m, frame, has_truth, has_beacons):
    log = made.circle_log(steps=300, seed=1)
    expected = extent_m(log)
    poses = np.column_stack([log.truth.x_m, log.truth.y_m, log.truth.theta_rad])
    places_m = np.column_stack([log.beacons.x_m, log.beacons.y_m])
    poses, places_m = frame.poses(poses), frame.points(places_m)
    shown = replace(
        log,
        truth=Truth(log.truth.time_us, *poses.T) if has_truth else None,
        beacons=Beacons(log.beacons.beacon_id, *places_m.T) if has_beacons else None,
    )
    np.testing.assert_allclose(extent_m(shown), expected, atol=0.5)  # of the sightings' noise
