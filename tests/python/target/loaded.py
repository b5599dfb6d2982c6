"""What a map is once it was loaded."""

from bslam.core.slam import Slam


def as_loaded(blob: bytes) -> bytes:
    """What is saved of a map that was loaded: what its values hung on besides is gone."""
    slam = Slam({}, beacons_max=20)
    slam.load_map(blob)
    again = slam.save_map()
    slam.load_map(again)
    assert slam.save_map() == again
    return again
