"""What a board keeps over a reset in QEMU: parameters and a map in its flash, its state in guarded RAM."""

import binascii
import contextlib
import re
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bslam.core.slam import Slam
from bslam.faults.promise import PARAMS, Course
from bslam.link.frames import crc16
from bslam.maps.blob import parse
from bslam.target.lines import QemuLine, TargetError
from bslam.target.remote import RemoteSlam
from target.loaded import as_loaded

FIRST_SECTOR = 0x080C0000
"""As in firmware/port/stm32f405/flash.c."""


def test_a_board_s_parameters_outlast_its_resets():
    line = QemuLine("microbit")
    with RemoteSlam(line, None, 6) as robot:
        for wheelbase_m in (0.31, 0.27, 0.29):
            robot.set_param("wheelbase_m", wheelbase_m)
            robot.save_params()
            line.restart()
            with pytest.raises(TargetError, match="started anew"):
                robot.update()
            robot = RemoteSlam(line, None, 6)
            assert robot.params["wheelbase_m"] == pytest.approx(wheelbase_m)
            assert robot.params["gate_d2"] == np.float32(Slam.defaults()["gate_d2"])


def kept(values, sequence):
    """A slot of flash with parameters in it: firmware/robot/param_store.c in firmware/port/kept.c."""
    names = b"".join(p.name.encode() + b"\0" for p in Slam.parameters())
    content = np.array(list(values.values()), "<f4").tobytes() + struct.pack("<H", crc16(names))
    content += struct.pack("<H", crc16(content))
    numbers = struct.pack("<II", sequence, len(content))
    head = b"KEPT" + numbers + struct.pack("<I", binascii.crc32(numbers + content))
    return head.ljust(64, b"\xff") + content


def test_the_stm32f405_loads_the_newer_of_its_sectors_and_says_that_qemu_s_cannot_be_written(tmp_path):
    more = []
    for slot, wheelbase_m in enumerate((0.25, 0.35)):
        path = tmp_path / f"slot{slot}"
        path.write_bytes(kept(Slam.defaults() | {"wheelbase_m": wheelbase_m}, slot + 7))
        more += ["-device", f"loader,file={path},addr={FIRST_SECTOR + slot * 0x20000:#x},force-raw=on"]
    with RemoteSlam(QemuLine("stm32f405", *more), None, 6) as robot:
        assert robot.params["wheelbase_m"] == pytest.approx(0.35)
        with pytest.raises(TargetError, match="STORE"):
            robot.save_params()


ROBOT_PARAMS = 16  # bytes into the robot: amid the parameters, which are guarded


def damage(line):
    """Flips a bit in the RAM of a running board."""
    image = Path(__file__).parents[3] / "build/microbit/robot.elf"
    names = subprocess.run(["arm-none-eabi-nm", image], capture_output=True, text=True, check=True).stdout
    robot = next(int(row.split()[0], 16) for row in names.splitlines() if row.endswith(" robot"))
    said = line.monitor("human-monitor-command", **{"command-line": f"gpa2hva {robot + ROBOT_PARAMS:#x}"})
    place = int(re.search(r"is (0x[0-9a-f]+)", said)[1], 16)
    with Path(f"/proc/{line.process_id}/mem").open("r+b", buffering=0) as memory:
        memory.seek(place)
        byte = memory.read(1)[0]
        memory.seek(place)
        memory.write(bytes((byte ^ 4,)))


def restarted(line, robot, says):
    """Press the reset button, and go on with what the board has then."""
    line.restart()
    with pytest.raises(TargetError, match=says):
        robot.update()
    return RemoteSlam(line, None, 6)


def test_a_reset_in_mid_run_costs_a_guarded_board_nothing_and_another_all():
    with contextlib.closing(QemuLine("microbit")) as line:
        course = Course(RemoteSlam(line, PARAMS, 6))
        course.slam.sightings(0, [], [], [], [])
        course.drive(10)
        assert restarted(line, course.slam, "what it knew is lost").beacons() == []
        _restart_a_guarded_one(line)


def test_a_board_s_flash_has_room_for_as_many_beacons_as_its_memory_has():
    """Each by its direction alone: four values of the state, and the sensor's four beside them."""
    params = PARAMS | {"correlation_m": 0.3, "sensor_doubt": 1}
    with contextlib.closing(QemuLine("microbit")) as line:
        robot = RemoteSlam(line, params, 6)
        robot.sightings(0, [], [], [], [])
        for time_us in range(40_000, 240_000, 40_000):
            robot.odometry("wheels", time_us, 0.004, 0.004)
            robot.sightings(time_us, np.arange(-3, 3) / 3, [np.nan] * 6, range(6), [True] * 6)
        blob = robot.save_map()
        assert len(blob) > 2000 and len(robot.beacons()) == 6
        robot.keep_map()
        robot = restarted(line, robot, "somewhere in the map that it kept")
        assert robot.save_map() == as_loaded(blob)


def _restart_a_guarded_one(line):
    course = Course(RemoteSlam(line, PARAMS | {"recovery": 1, "guard": 1}, 6))
    course.slam.sightings(0, [], [], [], [])
    course.drive(25)
    blob, pose = course.slam.save_map(), course.slam.pose()
    before_m = course.sd_m()
    course.slam.keep_map()
    course.slam = restarted(line, course.slam, "goes on with what it knew")
    now, then = parse(course.slam.save_map()), parse(blob)
    assert now.beacons == then.beacons and (now.values == then.values).all()
    assert np.allclose(now.covariance, then.covariance, rtol=1e-4, atol=1e-9)
    assert course.slam.pose() == pose and not course.slam.is_lost
    assert course.sd_m() > before_m + 0.1, "nobody knows how far it rolled"
    health = course.slam.health()
    assert (health.trouble, health.guards, health.recovers, health.corrupt) == ("restarted", True, True, 0)
    course.drive(25)
    assert course.error_m() < 0.02 and course.slam.health().insane == 0

    damage(line)
    course.slam = restarted(line, course.slam, "somewhere in the map that it kept")
    assert course.slam.is_lost and course.slam.save_map() == as_loaded(blob)
    course.drive(25)
    assert not course.slam.is_lost and course.error_m() < 0.05
    assert (course.slam.health().state, course.slam.health().found) == ("following", 1)
