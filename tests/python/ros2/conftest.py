from pathlib import Path

import pytest

from ros2.bags import Drive, parts, short_drive, write_bag


@pytest.fixture(scope="session")
def drive() -> Drive:
    return Drive(short_drive(600))


@pytest.fixture(scope="session")
def aruco(drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poses of markers from a camera on a mast, a gyro, the truth: mcap."""
    said = parts(drive.odometry(), drive.aruco(), drive.static(), drive.truth(), drive.gyro())
    return write_bag(tmp_path_factory.mktemp("bags") / "aruco", said)


@pytest.fixture(scope="session")
def tags(drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Corners of AprilTags from a camera that distorts, wheel joints, the truth: an old sqlite3 bag."""
    said = parts(
        drive.odometry(),
        drive.apriltags(),
        drive.static(),
        drive.truth(),
        drive.camera_info(),
        drive.joints(0.05),
    )
    return write_bag(tmp_path_factory.mktemp("bags") / "tags", said, "sqlite3", definitions=False)
