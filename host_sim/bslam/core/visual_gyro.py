"""The turn rate that the cameras tell, from turns between their frames."""

from __future__ import annotations

from dataclasses import asdict

from bslam.core.raw import vision_library
from bslam.core.vision import Turn


class VisualGyro:
    """As bslam_visual_gyro_t: `advance` to each reading of the wheels, then `take` that time's frames."""

    SD_RADPS = 0.04
    """What a rate errs by at least, for a log's `gyro_sigma_radps` (BSLAM_VISUAL_GYRO_SD_RADPS)."""
    WIDE_SD_RADPS = 1.0
    """The same if a lens is equidistant (BSLAM_VISUAL_GYRO_WIDE_SD_RADPS)."""

    def __init__(self, least_sd_radps: float) -> None:
        self._library = vision_library()
        self._gyro = self._library.ffi.new("bslam_visual_gyro_t *")
        size, sizes_hash = self._library.size_of("bslam_visual_gyro_t")
        status = self._library.lib.bslam_visual_gyro_init_sized(self._gyro, size, sizes_hash, least_sd_radps)
        self._library.ensure(status, "a visual gyro")

    def advance(self, time_us: int, speed_mps: float, speed_sd_mps: float) -> None:
        """Go on to a time; the forward speed since the time before, by the wheels. BslamError if refused."""
        status = self._library.lib.bslam_visual_gyro_advance(self._gyro, time_us, speed_mps, speed_sd_mps)
        self._library.ensure(status, f"visual gyro at {time_us} us, speed {speed_mps} m/s")

    def take(self, camera: int, turn: Turn | None) -> None:
        """A frame of a camera, and what it told (None: nothing). BslamError if refused."""
        library = self._library
        given = library.ffi.NULL if turn is None else library.new_filled("bslam_turn_t", **asdict(turn))
        status = library.lib.bslam_visual_gyro_take(self._gyro, camera, given)
        library.ensure(status, f"visual gyro, camera {camera}: {turn}")

    def rate(self) -> tuple[float, float] | None:
        """The turn rate of the last step and its noise, rad/s; None where it is not known."""
        rate, sd = (self._library.ffi.new("bslam_real_t *") for _ in range(2))
        return (rate[0], sd[0]) if self._library.lib.bslam_visual_gyro_rate(self._gyro, rate, sd) else None
