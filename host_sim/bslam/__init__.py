"""bslam: SLAM with beacons that fits in a microcontroller, and the harness that simulates and judges it.

`Slam` is the C estimator. Data flows one way: `world` or a recorded log -> `log.Log` -> `runs` (feeds `core`,
measures) -> files -> `view`.
"""

from importlib.metadata import version

from bslam.core import CoreError, Slam

__version__ = version("bslam")

__all__ = ["CoreError", "Slam", "__version__"]
