"""bslam: SLAM with beacons that fits in a microcontroller, and the harness that simulates and judges it.

    from bslam import Log, Slam

`Slam` is one robot, reading by reading; `Log` is a drive: `Log.from_dataframe(...)` or `Log.read("folder")`,
then `log.check()`, `log.run()` and `bslam.plot(run)`. docs/PYTHON.md shows them.

Inside, data flows one way: `world` or a recorded log -> `log.Log` -> `runs` (feeds `core`, measures) -> files
-> `view`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bslam.algorithms import Algorithm
    from bslam.api import Run, RunWords, check, plot, run, simulate
    from bslam.core import CoreError, Slam
    from bslam.errors import BslamError
    from bslam.log import Log, Robot
    from bslam.logcheck.finding import Report

    __version__: str

_HOMES = {
    "Algorithm": "bslam.algorithms",
    "BslamError": "bslam.errors",
    "CoreError": "bslam.core",
    "Log": "bslam.log",
    "Report": "bslam.logcheck.finding",
    "Robot": "bslam.log",
    "Run": "bslam.api",
    "RunWords": "bslam.api",
    "Slam": "bslam.core",
    "check": "bslam.api",
    "plot": "bslam.api",
    "run": "bslam.api",
    "simulate": "bslam.api",
}
"""Where each name stands."""

__all__ = [
    "Algorithm",
    "BslamError",
    "CoreError",
    "Log",
    "Report",
    "Robot",
    "Run",
    "RunWords",
    "Slam",
    "__version__",
    "check",
    "plot",
    "run",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """What is asked for, loaded then: `import bslam` alone is cheap."""
    if name == "__version__":
        from importlib.metadata import version

        return version("bslam")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'bslam' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
