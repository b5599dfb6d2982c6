"""Which extensions there are; bslam_build.py beside the package makes them."""

SIZE_CLASSES = (20, 80, 250)
"""Beacons that a build holds; `Slam` takes the smallest that suffices."""

REALS = ("float", "double")
"""Scalar types: float as on the target, double for the twin."""


def sightings_max(beacons_max: int) -> int:
    """Sightings of a frame that a build of so many beacons takes: every beacon, and some clutter."""
    return min(max(64, beacons_max + 16), 250)


def extension_name(real: str, beacons_max: int) -> str:
    """The module of one build: `bslam.core._float_20`."""
    return f"bslam.core._{real}_{beacons_max}"


VISION_EXTENSION = "bslam.core._vision"
"""The build of the vision front end: it holds no map, so one size serves all."""

CAMERA_EXTENSION = "bslam.world.camera._render"
"""The ray caster of the simulated camera."""
