"""`bslam import`: logs of other systems as log folders."""

from __future__ import annotations

import argparse
import math
import os
import shutil
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from bslam.errors import BslamError
from bslam.log import FILES, WHEEL_RADIUS_M, WHEELBASE_M, Log, Robot
from bslam.options import RunOptions, core_params
from bslam.parsing.settings import number, parse_table
from bslam.ros2.bag import name_of
from bslam.ros2.importer import Request, import_bag
from bslam.ros2.tags import HELP, SIDE_M, TagSizes, read_tag_sizes

SUMMARY = "make a log folder of a bag of ROS 2: odometry, markers, gyro, ground truth"
EXAMPLES = f"""examples:
  bslam import ros2 my_bag --odometry /odom --detections /apriltag/detections --tag-size 0.16
  bslam import ros2 my_bag --detections /aruco_markers --imu /imu --out my_drive
  bslam import ros2 drive.mcap --joints /joint_states --wheel-radius 0.033 --wheelbase 0.16
  bslam import ros2 drive.mcap --detections /tf --truth /mocap/pose --mount 0.1,0,0

BAG: a rosbag2 folder, FILE.mcap or FILE.db3; `pip install rosbags` reads it, without ROS.
Markers: AprilTagDetectionArray (apriltag_msgs, Isaac ROS), ArucoMarkers, ArucoDetection, MarkerArray
(aruco_msgs), Detection3DArray; or --detections /tf, with frames such as tag36h11:5. A topic that is not named
is the only one of its kind. Where the camera sits comes from /tf_static. Stamps are those of the headers.
--tags: {HELP}
Then: bslam check DIR, bslam replay csv DIR. Exit status 2: the last line says what is missing."""

_MOUNT_HELP = "in place of /tf_static; no PITCH: level; > 0: it looks down"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("format", type=_format, metavar="ros2", help="what the log is of")
    parser.add_argument("bag", type=Path, metavar="BAG", help="rosbag2 folder, FILE.mcap or FILE.db3")
    parser.add_argument("--odometry", metavar="TOPIC", help="nav_msgs/Odometry: poses become wheel travel")
    parser.add_argument("--detections", action=_Once, metavar="TOPIC", help="the markers of one camera")
    parser.add_argument("--joints", metavar="TOPIC", help="sensor_msgs/JointState in place of --odometry")
    parser.add_argument("--left-joint", metavar="NAME", help="default: the one with 'left' and 'wheel'")
    parser.add_argument("--right-joint", metavar="NAME", help="default: the one with 'right' and 'wheel'")
    parser.add_argument("--wheel-radius", type=float, metavar="METRES", help="of --joints")
    parser.add_argument("--wheelbase", type=float, metavar="METRES", help="distance between the wheels")
    parser.add_argument("--imu", metavar="TOPIC", help="sensor_msgs/Imu: the gyro's turn rate")
    parser.add_argument(
        "--truth", metavar="TOPIC[:FRAME]", help="true poses: PoseStamped, Odometry, or a child frame of /tf"
    )
    parser.add_argument("--tags", type=Path, metavar="FILE", help="sizes of tags, .toml or .csv")
    parser.add_argument("--tag-size", type=float, metavar="METRES", help="side of every tag's black square")
    parser.add_argument("--camera-info", metavar="TOPIC", help="default: that of the markers' frame")
    parser.add_argument("--image", choices=["raw", "rectified"], help="what the corners of AprilTags are of")
    parser.add_argument("--pixel-sd", type=float, default=0.5, metavar="PX", help="noise of corners (0.5)")
    parser.add_argument("--base", metavar="FRAME", help="the robot's frame; default: the odometry's child")
    parser.add_argument("--mount", metavar="X,Y,YAW[,PITCH[,ROLL]]", help=_MOUNT_HELP)
    parser.add_argument("--start", type=float, default=0.0, metavar="S", help="seconds of the bag (0)")
    parser.add_argument("--end", type=float, default=math.inf, metavar="S", help="default: its end")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="a key of robot.toml; may be repeated"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="the log folder; a log there is replaced (default: out/import/BAG)",
    )


def _format(word: str) -> str:
    if word != "ros2":
        hint = f"; did you mean: bslam import ros2 {word}" if Path(word).exists() else ""
        raise argparse.ArgumentTypeError(f"'{word}' does not exist; allowed: ros2{hint}")
    return word


class _Once(argparse.Action):
    """An option that would lose what it was given before."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        before = getattr(namespace, self.dest)
        if before is not None:
            raise BslamError(f"{option_string} {before} and {values}: allowed: one topic; a log per camera")
        setattr(namespace, self.dest, values)


def execute(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    out = arguments.out or Path("out/import") / name_of(arguments.bag)
    _require_place(out)
    imported = import_bag(arguments.bag, _request(arguments))
    replaced = _write(imported.log, out)
    for line in (*imported.said, *replaced):
        print(line)
    print(f"log in {out}; next: bslam check {out}; bslam replay csv {out}")
    return 0


def _request(arguments: argparse.Namespace) -> Request:
    pixel_sd, radius = number(1e-3, 100.0).convert(arguments.pixel_sd, "--pixel-sd"), arguments.wheel_radius
    return Request(
        odometry=arguments.odometry,
        detections=arguments.detections,
        joints=arguments.joints,
        left_joint=arguments.left_joint,
        right_joint=arguments.right_joint,
        wheel_radius_m=None if radius is None else WHEEL_RADIUS_M.convert(radius, "--wheel-radius"),
        imu=arguments.imu,
        truth=arguments.truth,
        camera_info=arguments.camera_info,
        rectified=None if arguments.image is None else arguments.image == "rectified",
        sizes=_sizes(arguments),
        pixel_sd=pixel_sd,
        base=arguments.base,
        mount=None if arguments.mount is None else _mount(arguments.mount),
        robot=_robot_keys(arguments),
        start_s=_start_s(arguments),
        end_s=arguments.end,
    )


def _sizes(arguments: argparse.Namespace) -> TagSizes | None:
    if arguments.tags is None and arguments.tag_size is None:
        return None
    table = TagSizes({}) if arguments.tags is None else read_tag_sizes(arguments.tags)
    if arguments.tag_size is None:
        return table
    return TagSizes(table.side_m, SIDE_M.convert(arguments.tag_size, "--tag-size"))


def _start_s(arguments: argparse.Namespace) -> float:
    start_s = float(arguments.start)
    if not 0.0 <= start_s < arguments.end:
        raise BslamError(f"--start {start_s:g}, --end {arguments.end:g}: allowed: 0 <= start < end")
    return start_s


def _mount(text: str) -> tuple[float, ...]:
    limits = (*[number(-100.0, 100.0)] * 2, *[number(-3.2, 3.2)] * 3)
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if not 3 <= len(values) <= len(limits):
        raise BslamError(
            f"--mount {text!r}: allowed: X_M,Y_M,YAW_RAD, as 0.1,0,0, and ,PITCH_RAD,ROLL_RAD if not level"
        )
    return tuple(rule.convert(one, f"--mount {text}") for rule, one in zip(limits, values, strict=False))


def _robot_keys(arguments: argparse.Namespace) -> dict[str, Any]:
    """Keys of robot.toml that the command line gives, each checked."""
    keys: dict[str, Any] = {}
    for text in arguments.set:
        name, equals, value = text.partition("=")
        try:
            keys |= tomllib.loads(f"{name} = {value}") if equals else {}
        except tomllib.TOMLDecodeError:
            equals = ""
        if not equals:
            raise BslamError(f"--set {text!r}: allowed: KEY=VALUE, as wheel_speed_sigma_mps=0.02")
    if arguments.wheelbase is not None:
        keys["wheelbase_m"] = WHEELBASE_M.convert(arguments.wheelbase, "--wheelbase")
    required = dict.fromkeys(("wheelbase_m", "step_us", "range_sigma_scale_m"), 1)  # the bag will say
    noise = ("wheel_speed_sigma_mps", "field_of_view_rad", "bearing_sigma_rad", "range_sigma_fraction")
    parse_table(Robot, {**required, **dict.fromkeys(noise, 1.0), **keys}, "--set")
    return keys


def _require_place(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise BslamError(f"--out {out}: there is a file of that name; allowed: a folder")
    if (out / "metadata.yaml").exists():
        raise BslamError(f"--out {out}: a bag is there; allowed: a folder of the log's own")


def _write(log: Log, out: Path) -> list[str]:
    """The log folder, whole or not at all: in a folder that is there, its log files are replaced, which the
    lines returned say.
    """
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}."))
        try:
            log.write(made)
            _require_usable(made, out)
            made.chmod(0o755)  # mkdtemp makes it private
            if not out.exists():
                made.rename(out)
                return []
            return _replace(made, out)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except OSError as error:
        raise BslamError(f"--out {out}: cannot be written: {error}; allowed: a place to write to") from error


def _replace(made: Path, out: Path) -> list[str]:
    """Log files take the place of those in a folder that is there; a line that says which."""
    there = [name for name in FILES if (out / name).exists()]
    for name in FILES:
        if (made / name).exists():
            os.replace(made / name, out / name)
        else:
            (out / name).unlink(missing_ok=True)
    replaced = ", ".join(name for name in there if (out / name).exists())
    removed = ", ".join(name for name in there if not (out / name).exists())
    said = "; ".join(
        f"{word} {names}" for word, names in (("replaced", replaced), ("removed", removed)) if names
    )
    return [f"{out}: {said}"] if said else []


def _require_usable(made: Path, out: Path) -> None:
    """Whatever no file of a log may hold is found before a log that is there is replaced."""
    try:
        core_params(RunOptions(sensor="recorded"), Log.read(made))
    except BslamError as error:
        raise BslamError(str(error).replace(made.name, out.name)) from None
