"""Pictures over the link: the robot's own front end sees what the host's sees, to the bit."""

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest

from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.core.vision import FrontEnd
from bslam.link.messages import CameraRecord
from bslam.rig import load_rig
from bslam.target.lines import ProcessLine, open_line
from bslam.target.remote import RemoteSlam
from bslam.world.camera.renderer import Renderer
from bslam.world.camera.rgb565 import to_rgb565
from bslam.world.camera.worlds import dress
from bslam.world.simulate import load_scenario, true_drive

ROBOT = Path(__file__).parents[3] / "build" / "host" / "robot"
STEPS = (240, 300, 330, 420, 570)


@pytest.fixture(scope="module")
def camera():
    """Of half the pixels each way, since QEMU's serial line takes 50 us a byte."""
    whole = load_rig("three60").cameras[1]
    lens = whole.lens
    sides = {name: getattr(lens, name) // 2 for name in ("width_px", "height_px")}
    lengths = {name: getattr(lens, name) / 2 for name in ("fx_px", "fy_px")}
    centre = {name: (getattr(lens, name) - 0.5) / 2 for name in ("cx_px", "cy_px")}
    return replace(whole, lens=replace(lens, **sides, **lengths, **centre))


@pytest.fixture(scope="module")
def pictures(camera):
    """What the camera shows at STEPS of a drive, RGB565."""
    scenario = load_scenario("paper_room")
    renderer, path = Renderer(dress(scenario, 0), camera, [0, 1]), true_drive(scenario, 0)
    poses = [(path.x_m[step], path.y_m[step], path.theta_rad[step]) for step in STEPS]
    return [to_rgb565(renderer.render(pose, 0.04 * i).rgb) for i, pose in enumerate(poses)]


def record(camera):
    """The camera as it goes over the link."""
    lens = camera.lens
    kind, *numbers = astuple(lens)
    mounting = (camera.yaw_rad, camera.pitch_rad, camera.z_m)
    return CameraRecord(0 if kind == "pinhole" else 1, *numbers, *mounting)
    return CameraRecord(
        0 if lens.kind == "pinhole" else 1, *numbers, camera.yaw_rad, camera.pitch_rad, camera.z_m
    )


@pytest.mark.parametrize(("target", "last"), [(f"process:{ROBOT}", 5), ("qemu:mps2_an386", 2)])
def test_a_robot_that_is_sent_pictures_sees_and_maps_what_the_host_does(target, last, camera, pictures):
    params = {"association": 2, "velocity_states": 0}
    here, eyes = Slam(params, beacons_max=80), FrontEnd([camera])
    count = 0
    with RemoteSlam(open_line(target), params, 20, fingerprints=True) as there:
        there.set_camera(0, record(camera))
        chain = 0xCBF29CE484222325
        for step, picture in enumerate(pictures[:last]):
            time_us = (step + 1) * 40_000
            for slam in (here, there):
                slam.odometry("wheels", time_us, 0.3, 0.3)
            chain = here.fingerprint(chain)
            seen, accounts = there.look(time_us, 0, picture, True)
            expected = [one for one in eyes.see(picture).candidates if one.bearing_rad is not None]
            count += len(seen)
            assert [one.bearing_rad for one in seen] == [one.bearing_rad for one in expected]
            assert all((a.signature == b.signature).all() for a, b in zip(seen, expected, strict=True))
            ranges = [np.nan if one.range_m is None else one.range_m for one in expected]
            range_sds = [one.range_sd_m or 0.0 for one in expected]
            columns = [[one.bearing_rad for one in expected], ranges, [-1] * len(seen), [True] * len(seen)]
            bearing_sds = [one.bearing_sd_rad for one in expected]
            assert accounts == here.sightings(time_us, *columns, bearing_sds, range_sds)
            chain = here.fingerprint(chain)
            assert there.fingerprint(0) == chain
    assert count > 0


def test_pictures_that_cannot_be_are_refused(camera, pictures):
    with RemoteSlam(ProcessLine(ROBOT), {}, 20) as robot:
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(40_000, 0, pictures[0], True)  # no camera yet
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.set_camera(9, record(camera))
        with pytest.raises(CoreError, match="BSLAM_E_PARAMETER"):
            robot.set_camera(0, CameraRecord(**(vars(record(camera)) | {"fx_px": -1.0})))
        robot.set_camera(0, record(camera))
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(40_000, 0, pictures[0][:100], True)  # rows are missing
        with pytest.raises(CoreError, match="BSLAM_E_COUNT"):
            robot.look(80_000, 0, np.concatenate([pictures[0], pictures[0]]), True)  # too many
        here = FrontEnd([camera]).see(pictures[0]).candidates
        seen, _ = robot.look(120_000, 0, pictures[0], True)
        assert len(seen) == sum(one.bearing_rad is not None for one in here)
