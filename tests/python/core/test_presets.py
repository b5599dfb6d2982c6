"""The presets are those of the C library."""

import pytest

from bslam.core import Slam
from bslam.core.presets import PRESETS, preset_settings
from bslam.core.raw import library
from bslam.errors import BslamError
from bslam.options import ASSOCIATIONS, FILTERS

KNOWN, SVM = ASSOCIATIONS.index("known"), ASSOCIATIONS.index("svm")
INVARIANT, SMOOTHER = FILTERS.index("invariant"), FILTERS.index("smoother")


def changes(*names, association=KNOWN, filter_=INVARIANT):
    """What they change of the defaults."""
    defaults = Slam.defaults() | {"association": association, "filter": filter_}
    found = preset_settings(names, association, filter_)
    assert list(found) == list(defaults)
    return {name: value for name, value in found.items() if value != defaults[name]}


def test_names_are_those_of_the_enum_in_its_order():
    names = library("float", 1).enum_names("bslam_preset_t", "BSLAM_PRESET_", space="-")
    assert dict(sorted(names.items())) == dict(enumerate([*PRESETS, "count"]))


def test_defaults_are_for_real_wheels():
    assert changes() == changes("real-wheels") == {}


def test_paper_lets_the_reading_of_a_wheel_err():
    speeds = {"velocity_states": 1, "left_speed_sd_mps": 0.3, "right_speed_sd_mps": 0.3}
    assert changes("paper") == speeds | {"correlation_m": -1}
    assert changes("paper", "real-wheels") == {}


def test_camera_goes_on_top_and_chooses_by_association():
    known, unknown = (changes("camera", association=one) for one in (KNOWN, SVM))
    assert known.items() < unknown.items()
    assert set(unknown) - set(known) == {
        "confirm_sightings",
        "confirm_travel_m",
        "confirm_window_us",
        "duplicate_sd_m",
    }
    assert changes("paper", "camera") == changes("paper") | known


def test_commanded_goes_on_top_and_chooses_by_association_and_filter():
    known, unknown, smoothed = (
        changes("commanded", association=association, filter_=filter_)
        for association, filter_ in ((KNOWN, INVARIANT), (SVM, INVARIANT), (KNOWN, SMOOTHER))
    )
    assert known["scale_states"] == 1 and known["left_speed_sd_mps"] == known["gate_d2"] == 0
    assert known["sighting_delay_us"] == 175_000
    assert smoothed == known | {"bearing_sd_rad": 0.1}
    # Association wants sharp noise, consistency wants it wide.
    assert unknown["bearing_sd_rad"] < known["bearing_sd_rad"]
    assert set(unknown) - set(known) == {"match_d2", "new_d2", "confirm_window_us"}


def test_bearing_only_is_for_the_smoother():
    assert changes("bearing-only") == {}
    assert changes("bearing-only", filter_=SMOOTHER)["velocity_walk_mps_sqrt_s"] == 30.0


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("real", ["float", "double"])
def test_every_preset_is_taken(name, real):
    params = preset_settings([name], SVM, SMOOTHER)
    assert Slam(params, real=real).params == pytest.approx(params, rel=1e-7)


def test_unknown_preset_is_refused_with_the_known_ones():
    with pytest.raises(BslamError, match="preset 'wheels' does not exist; allowed: real-wheels, paper, "):
        preset_settings(["wheels"], KNOWN, INVARIANT)
