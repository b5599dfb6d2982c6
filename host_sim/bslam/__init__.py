"""bslam: SLAM with beacons that fits in a microcontroller, and the harness that simulates and judges it.

    from bslam import Slam

Data flows one way: `world` or a recorded log -> `log.Log` -> `runs` (feeds `core`, measures) -> files
-> `view`.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bslam.core import CoreError, Slam

__all__ = ["CoreError", "Slam", "__version__"]


def __getattr__(name: str) -> Any:
    """What is asked for, loaded then: `import bslam` alone is cheap."""
    if name == "__version__":
        from importlib.metadata import version

        return version("bslam")
    if name in __all__:
        from bslam import core

        return getattr(core, name)
    raise AttributeError(f"module 'bslam' has no attribute '{name}'")
