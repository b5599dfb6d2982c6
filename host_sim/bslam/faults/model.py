"""The fault model: every kind of fault that the project answers for, and the faults that inject it.

Written before the code it is held against; docs/FAULTS.md shows it. What of it is injected by no fault is
missing, and a promise that is not kept.
"""

from __future__ import annotations

from collections.abc import Sequence

from bslam.faults.promise import Fault

FAULT_MODEL: dict[str, dict[str, tuple[str, ...]]] = {
    "NaN, infinity, denormal in any input": {
        "NaN": ("NaN in odometry", "NaN in a sighting", "NaN in any other input"),
        "infinity": ("infinity in odometry", "infinity in a sighting", "infinity in any other input"),
        "denormal": ("denormal in odometry", "denormal in a sighting"),
    },
    "an interval that is none, or too long": {
        "zero, negative": ("dt zero", "dt negative"),
        "too long": ("dt too long",),
        "a long gap": ("long gap",),
    },
    "wheel encoders": {"roll-over": ("encoder roll-over",), "reset": ("encoder reset",)},
    "odometry lost, doubled, out of order": {
        "lost": ("odometry lost",),
        "doubled": ("odometry twice",),
        "out of order": ("odometry out of order",),
    },
    "frames lost, doubled, out of order": {
        "lost": ("frames lost",),
        "doubled": ("frame twice",),
        "out of order": ("frame out of order",),
    },
    "wheel slip, bump, kidnapping": {
        "slip": ("wheel slip",),
        "bump": ("bump",),
        "kidnapping": ("kidnapping", "no kidnapping"),
        "switched on in a kept map": ("restart in a kept map", "restart by directions alone"),
    },
    "30 to 50 % outlier observations": {"outliers": ("40 % outlier sightings",)},
    "beacons that look alike, or are moved": {
        "look-alikes": ("look-alike beacons",),
        "moved": ("beacon moved",),
    },
    "stores that are full": {"map": ("map full",), "samples": ("sample store full",)},
    "the covariance loses definiteness": {"definiteness": ("covariance loses definiteness",)},
    "hours of running in float32": {"float32": ("long run in float32",)},
    "images": {
        "truncated": ("image: truncated",),
        "black": ("image: black",),
        "overexposed": ("image: overexposed",),
        "covered, blurred": ("image: covered", "image: half covered", "image: blurred"),
    },
    "the serial line": {
        "bit flips": ("line: bits flipped",),
        "truncation": ("line: truncation",),
        "flood": ("line: flood",),
        "replay": ("line: message twice", "line: replay"),
        "another version": ("line: other version",),
    },
    "power loss during a map save": {"cuts": ("power loss during a save",)},
    "watchdog, warm restart": {
        "memory good": ("watchdog: memory good",),
        "memory bad": ("watchdog: memory bad",),
    },
    "a RAM bit flip in guarded state": {
        "detected": ("RAM bit flip",),
        "fallen back from": ("fall back to the last good state",),
    },
    "malformed files": {
        "model": ("malformed model",),
        "map": ("malformed map",),
        "maps to be merged": ("maps of two places merged",),
    },
    "stack overflow": {"excluded": ("stack overflow",)},
}


def missing_parts(faults: Sequence[Fault]) -> list[str]:
    """Parts of the model of which some fault is not there."""
    names = {one.name for one in faults}
    return [
        f"{row}: {part}"
        for row, parts in FAULT_MODEL.items()
        for part, needed in parts.items()
        if not needed or not names.issuperset(needed)
    ]
