"""The C library from Python: `Slam` is the class to use; `raw` is the 1:1 layer under it."""

from bslam.core.errors import CoreError
from bslam.core.slam import Account, Beacon, Parameter, Slam

__all__ = ["Account", "Beacon", "CoreError", "Parameter", "Slam"]
