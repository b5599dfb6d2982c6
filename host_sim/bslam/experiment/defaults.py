"""Parameter sets that are not the core's own defaults: one for real logs, one for direction-only.

One set serves every real log; none is tuned to a robot or a recording.
"""

from __future__ import annotations

from typing import Final

# Velocity commands lead the motion that a motion-capture system sees by 0.15-0.20 s (MRCLAM, every robot).
REAL_ODOMETRY_LEAD_US: Final = 175_000
# The stamp of an image is 20-40 ms late.
_IMAGE_DELAY_US: Final = 30_000

REAL_LOG: Final[dict[str, int | float]] = {
    # A commanded speed is not the driven one, and by how much differs between robots: estimate the scales.
    "scale_states": 1,
    "scale_sd": 0.1,
    "scale_walk_sqrt_s": 0.002,
    # Wheels that follow a command err in proportion to motion: 1.6 x what `bslam calibrate` finds.
    "forward_sd_per_sqrt_s": 0.02,
    "turn_sd_per_sqrt_s": 0.04,
    # Successive sightings err alike (lag-1 correlation of the distance 0.96): the scatter about the truth
    # (0.01 rad; 0.02 m + 0.035 r) times 4, so that many of them do not count as much evidence.
    "bearing_sd_rad": 0.04,
    "range_sd_floor_m": 0.08,
    "range_sd_fraction": 0.14,
    "range_sd_per_m": 0.0,
    # After a wheel slips, a gate of the usual size rejects sightings for good. Huber weights from early on
    # let the estimate come back; the gate only keeps out barcodes read as another one, metres off.
    "gate_d2": 200,
    "huber_d": 0.3,
    "sighting_delay_us": REAL_ODOMETRY_LEAD_US + _IMAGE_DELAY_US,
}

# Nothing yet: the core's defaults (bearing variance times 4, inverse distance 0.2 +- 0.1 1/m) are the best
# known.
DIRECTION_ONLY: Final[dict[str, int | float]] = {}
