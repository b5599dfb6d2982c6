"""The C library's presets: sets of values of its settings."""

from __future__ import annotations

from collections.abc import Iterable

from bslam.core.raw import library
from bslam.errors import BslamError, did_you_mean

PRESETS = ("real-wheels", "paper", "commanded", "camera", "bearing-only")
"""Their names, in the order of bslam_preset_t. The first two set everything, the others go on top."""


def preset_settings(names: Iterable[str], association: int, filter_: int) -> dict[str, int | float]:
    """Every setting by name: the default preset, and on top of it those that are named.

    association, filter_: the settings of that name, by which presets choose. Raises BslamError for an unknown
    preset.
    """
    raw = library("double", 1)  # its numbers are those that stand in the header
    settings = raw.ffi.new("bslam_settings_t *")
    for name in (PRESETS[0], *names):
        if name not in PRESETS:
            near = did_you_mean(name, PRESETS)
            raise BslamError(f"preset '{name}' does not exist; allowed: {', '.join(PRESETS)}{near}")
        raw.lib.bslam_settings_preset(settings, PRESETS.index(name))
        settings.association, settings.filter = association, filter_
    return {raw.text(info.name): getattr(settings, raw.text(info.name)) for info in raw.settings_infos()}
