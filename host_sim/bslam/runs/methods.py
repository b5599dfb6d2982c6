"""The algorithms that can be compared: those that come with bslam, and a user's own by module and class."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bslam.algorithms import Algorithm, Setup
from bslam.errors import BslamError, did_you_mean, pip_install

OURS: Final = "bslam"
BOUND: Final = "map"
"""The method that all others are measured by."""


@dataclass(frozen=True)
class Method:
    """An algorithm by name: small enough to send to another process and loaded there."""

    name: str
    where: str  # "module:Class", or "path/to/file.py:Class"
    meaning: str = "your own"
    settings: tuple[tuple[str, Any], ...] = ()  # keyword arguments of the constructor
    needs: tuple[str, ...] = ()  # packages beyond bslam's own
    files: tuple[str, ...] = ()  # and files that other packages bring
    install: str = ""  # the command that brings both
    only_with: str | None = None  # the one observation that it can do with; None: any
    shipped: bool = False

    @property
    def is_here(self) -> bool:
        """Everything it needs is installed."""
        return all(importlib.util.find_spec(package) is not None for package in self.needs) and all(
            Path(file).is_file() for file in self.files
        )

    def prepare(self) -> None:
        """Have made what takes longer than a call may. Raises BslamError if that cannot be."""
        if self.files:
            importlib.import_module(self.where.partition(":")[0]).prepare()


def shipped_methods(map_every: int) -> list[Method]:
    """What comes with bslam, ours first; the exact MAP is solved at every `map_every`-th step."""
    folder = "bslam.algorithms"
    return [
        Method(OURS, f"{folder}.ours:Bslam", "bslam's own core", shipped=True),
        Method("dead_reckoning", f"{folder}.dead_reckoning:DeadReckoning", "odometry alone", shipped=True),
        Method(
            BOUND,
            f"{folder}.causal_map:CausalMap",
            "exact causal MAP, the bound",
            (("every", map_every),),
            shipped=True,
        ),
        Method(
            "isam2",
            f"{folder}.isam2:Isam2",
            "GTSAM's incremental smoother",
            needs=("gtsam",),
            install=pip_install("gtsam"),
            shipped=True,
        ),
        Method(
            "mrpt",
            f"{folder}.mrpt:MrptEkf",
            "MRPT's EKF-SLAM",
            files=("/usr/include/mrpt/slam/include/mrpt/slam/CRangeBearingKFSLAM2D.h",),
            install="apt-get install libmrpt-slam-dev",
            only_with="distance",
            shipped=True,
        ),
    ]


def own_method(text: str) -> Method:
    """The method of "module:Class" or "file.py:Class". Raises BslamError if there is no such place."""
    module, colon, name = text.rpartition(":")
    allowed = "allowed: module:Class, or path/to/file.py:Class"
    if not colon or not module or not name.isidentifier():
        raise BslamError(f"--with {text}: names no class; {allowed}")
    if module.endswith(".py"):
        if not Path(module).is_file():
            raise BslamError(f"--with {text}: there is no file {module}; {allowed}")
        return Method(name, f"{Path(module).absolute()}:{name}")
    if not all(word.isidentifier() for word in module.split(".")):
        raise BslamError(f"--with {text}: '{module}' is no module name; {allowed}")
    _look_beside_the_user()
    try:
        found = importlib.util.find_spec(module)
    except ImportError:
        found = None
    if found is None:
        raise BslamError(f"--with {text}: there is no module {module}, here or installed; {allowed}")
    return Method(name, f"{module}:{name}")


def method_digest(method: Method) -> str:
    """Of the file that it stands in: results of two versions are not one."""
    place = method.where.rpartition(":")[0]
    if not place.endswith(".py"):
        _look_beside_the_user()
        spec = importlib.util.find_spec(place)
        place = "" if spec is None or spec.origin is None else spec.origin
    path = Path(place)
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.is_file() else "unknown"


def load_method(method: Method) -> Callable[[Setup], Algorithm]:
    """What makes the algorithm from its setup. Raises BslamError if there is no such class, and what its
    module raises.
    """
    place, _, name = method.where.rpartition(":")
    module = _load_file(Path(place)) if place.endswith(".py") else _load_module(place)
    made = getattr(module, name, None)
    if not callable(made):
        classes = [word for word, one in vars(module).items() if inspect.isclass(one) and not _lacks(one)]
        there = ", ".join(classes) or "none"
        allowed = f"those with the methods of docs/PLUGIN.md: {there}{did_you_mean(name, classes)}"
        raise BslamError(f"{place} has no class {name}; allowed: {allowed}")
    return maker_of(made, **dict(method.settings))


def maker_of(made: Callable[..., Algorithm], **settings: Any) -> Callable[[Setup], Algorithm]:
    """What makes the algorithm of a class from its setup. Raises BslamError for what is no such class."""
    if not isinstance(made, type):
        said = repr(made) if isinstance(made, str) else f"of type {type(made).__name__}"
        raise BslamError(f"algorithm {said}: is no class; allowed: the class itself, log.run(MySlam) say")
    if missing := _lacks(made):
        raise BslamError(
            f"{made.__name__} has no {', '.join(missing)}; allowed: a class as in docs/PLUGIN.md"
        )
    takes_setup = bool(inspect.signature(made).parameters)
    return (lambda setup: made(setup, **settings)) if takes_setup else (lambda setup: made(**settings))


def _lacks(made: object) -> list[str]:
    """Methods that an algorithm needs and this has not."""
    return [word for word in ("reset", "odometry", "observe", "pose", "map") if not hasattr(made, word)]


def _load_module(name: str) -> Any:
    _look_beside_the_user()
    return importlib.import_module(name)


def _load_file(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # a dataclass looks its own module up
    sys.path.insert(0, str(path.parent))  # its neighbours, as for a script
    spec.loader.exec_module(module)
    return module


def _look_beside_the_user() -> None:
    """A module in the working directory is found, as `python -m` finds it."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
