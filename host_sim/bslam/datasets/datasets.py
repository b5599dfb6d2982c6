"""Where real data lies on this machine. The repository holds none."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from bslam.errors import BslamError, nearest

VARIABLE: Final = "BSLAM_DATA"
SIGNS: Final = {"csv": "odometry.csv*", "mrclam": "Robot*_Odometry.dat*", "dlr": "map.circles*"}
"""A file by which a folder's format is told."""
_OWN_LOGS: Final = "paper_room"  # the collection of csv folders: users' own are elsewhere
_OF_A_BAG: Final = ("metadata.yaml", "*.db3")
_REPOSITORY: Final = Path(__file__).resolve().parents[3]


def data_root() -> Path | None:
    """The directory named by BSLAM_DATA, else ../shared/data beside the repository if it is there, else None.

    Raises BslamError if BSLAM_DATA names something that is not a directory.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_dir():
            raise BslamError(
                f"{VARIABLE}: '{named}' is not a directory; allowed: the directory with the data sets"
            )
        return Path(named)
    beside = _REPOSITORY.parent / "shared" / "data"
    return beside if beside.is_dir() else None


def line_to_type(command: str, word: str) -> str:
    """What to append to a message about `word`: "; did you mean: bslam COMMAND csv DIR", or a bag's import.

    DIR is that folder or the nearest one of the place; "" if it is no log.
    """
    folder = Path(word) if Path(word).exists() else near_folder(word)
    if folder is None:
        return ""
    if is_bag(folder):
        return f"; did you mean: bslam import ros2 {folder}"
    kind = _kind_in(folder)
    return "" if kind is None else f"; did you mean: bslam {command} {kind} {folder}"


def is_bag(path: Path) -> bool:
    """Whether that is a bag of ROS 2, and no log."""
    if not path.is_dir():
        return path.suffix == ".db3"
    return _kind_in(path) is None and any(any(path.glob(sign)) for sign in _OF_A_BAG)


def _kind_in(folder: Path) -> str | None:
    """The format of the log in a folder."""
    return next((kind for kind, sign in SIGNS.items() if any(folder.glob(sign))), None)


def near_folder(word: str) -> Path | None:
    """The folder with a log or bag, at the place of the path `word`, whose name is most like it."""
    place = Path(word).parent
    folders = [one for one in place.iterdir() if one.is_dir()] if place.is_dir() else []
    name = nearest(Path(word).name, [one.name for one in folders if _kind_in(one) or is_bag(one)])
    return None if name is None else place / name


def find_directory(name: str, collection: str) -> Path:
    """The directory `name`: as a path, else inside the data root, else inside its folder `collection`.

    Raises BslamError that says what is missing, from where to get it, and which variable names its place.
    """
    if Path(name).is_dir():
        return Path(name).absolute()  # worker processes may have another working directory
    root = data_root()
    for place in [root / name, root / collection / name] if root else []:
        if place.is_dir():
            return place
    near = near_folder(name)
    if collection == _OWN_LOGS and (root is None or near or Path(name).name != name):
        said = f"; did you mean {str(near)!r}?" if near else ""
        allowed = "the path of a folder with odometry.csv, sightings.csv, robot.toml"
        raise BslamError(f"{name}: no such directory; allowed: {allowed}{said}")
    if root is None:
        raise BslamError(
            f"{name}: no such directory, and no data sets are at hand; allowed: a path; "
            f"{_how_to_get(collection)}"
        )
    there = sorted(entry.name for entry in (root / collection).glob("*") if entry.is_dir())
    raise BslamError(
        f"{name}: no such directory; allowed: a path, or of {root}: {', '.join(there) or 'nothing'}"
    )


def _how_to_get(collection: str) -> str:
    if collection == "mrclam":
        return (
            "get the UTIAS Multi-Robot Cooperative Localization and Mapping data set from its authors' page "
            f"and let {VARIABLE} name the directory that holds mrclam/MRCLAM_Dataset1 and so on"
        )
    return f"let {VARIABLE} name the directory that holds it"
