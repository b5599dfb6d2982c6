"""Where real data lies on this machine. The repository holds none."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from bslam.errors import BslamError

VARIABLE: Final = "BSLAM_DATA"
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
    return f"let {VARIABLE} name the directory that holds {collection}/"
