"""What Python may hand over: numbers of any kind, as tables give them; anything else is refused by name."""

from collections.abc import Callable

import numpy as np
import pytest

from bslam.core import Slam
from bslam.core.slam import SIGNATURE_SIZE
from bslam.errors import BslamError

ONE = ([0.1], [2.0], [3], [True])
NO_NUMBER = [None, "x", "1.0", [1.0], np.array([1.0]), object(), 1j]
NOT_WHOLE = [*NO_NUMBER, 2.5, float("nan"), float("inf"), np.float32(0.5), 2**70, -(2**70)]


def started() -> Slam:
    slam = Slam({"velocity_states": 0}, beacons_max=20)
    slam.odometry("wheels", 0, 0.0, 0.0)
    slam.sightings(0, *ONE)
    return slam


def test_numbers_of_numpy_and_whole_ones_as_floats_are_taken() -> None:
    plain, other = started(), started()
    plain.odometry("wheels", 40_000, 0.25, 0.5, 0.125)
    other.odometry("wheels", np.float64(40_000.0), np.float32(0.25), np.float64(0.5), np.float32(0.125))
    plain.sightings(40_000, [0.1, 0.5], [2.0, 3.0], [3, 4], [True, True], [0.01, 0.02], [0.1, 0.1])
    columns = (np.array([0.1, 0.5]), (2.0, 3.0), [3.0, np.float64(4)], np.array([True, True]))
    other.sightings(np.int32(40_000), *columns, np.array([0.01, 0.02]), [np.float32(0.1).item()] * 2)
    assert [one.label for one in other.beacons()] == [3, 4]
    np.testing.assert_allclose(other.pose(), plain.pose(), atol=1e-6)
    ticks = Slam({"counter_bits": 32})
    ticks.odometry("ticks", 0, 7.0, np.uint32(2**32 - 1))


@pytest.mark.parametrize("bad", NO_NUMBER)
@pytest.mark.parametrize(
    "call",
    [
        lambda s, bad: s.odometry("wheels", 40_000, bad, 0.0),
        lambda s, bad: s.odometry("velocity", 40_000, 0.0, bad),
        lambda s, bad: s.odometry("wheels", 40_000, 0.0, 0.0, bad if bad is not None else "x"),
        lambda s, bad: s.odometry("wheels", 40_000, 0.0, 0.0, 0.0, bad),
        lambda s, bad: s.sightings(40_000, [bad], [2.0], [3], [True]),
        lambda s, bad: s.sightings(40_000, [0.1], [bad], [3], [True]),
        lambda s, bad: s.sightings(40_000, *ONE, [bad]),
        lambda s, bad: s.sightings(40_000, *ONE, score=[bad]),
        lambda s, bad: s.resume_odometry(bad, 0.1),
        lambda s, bad: s.restart(0.1, bad),
        lambda s, bad: s.set_pose(0.0, bad, 0.0, 0.1, 0.1),
        lambda s, bad: s.set_pose(0.0, 0.0, 0.0, 0.1, bad),
        lambda s, bad: s.add_known_beacon(9, bad, 0.0),
        lambda s, bad: Slam({"wheelbase_m": bad}),
    ],
)
def test_what_is_no_number_is_refused_and_changes_nothing(call: Callable[..., object], bad: object) -> None:
    refused_and_the_same(call, bad)


@pytest.mark.parametrize("bad", NOT_WHOLE)
@pytest.mark.parametrize(
    "call",
    [
        lambda s, bad: s.odometry("wheels", bad, 0.0, 0.0),
        lambda s, bad: s.odometry("ticks", 40_000, bad, 0),
        lambda s, bad: s.sightings(bad, *ONE),
        lambda s, bad: s.sightings(40_000, [0.1], [2.0], [bad], [True]),
        lambda s, bad: s.sightings(40_000, *ONE, beacon_class=[bad]),
        lambda s, bad: s.pose_at(bad),
        lambda s, bad: s.add_known_beacon(bad, 1.0, 0.0),
        lambda s, bad: s.remove_beacon(bad),
        lambda s, bad: Slam(beacons_max=bad),
        lambda s, bad: Slam({"confirm_sightings": bad}),
    ],
)
def test_what_is_not_whole_is_refused_and_changes_nothing(call: Callable[..., object], bad: object) -> None:
    refused_and_the_same(call, bad)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda s: s.odometry("sonar", 40_000, 0.0, 0.0), "'sonar': allowed are wheels, ticks, velocity"),
        (
            lambda s: s.odometry("ticks", 40_000, -1, 0),
            r"odometry at 40000 us: left_ticks -1: allowed is a whole",
        ),
        (lambda s: s.odometry("ticks", 40_000, 0, 2**32), "right_ticks 4294967296: .*from 0 to 4294967295"),
        (
            lambda s: s.odometry("wheels", 2**63, 0.0, 0.0),
            f"odometry at {2**63} us: time_us {2**63}: allowed",
        ),
        (lambda s: s.sightings(2**63, *ONE), f"frame at {2**63} us: time_us {2**63}: allowed is"),
        (
            lambda s: s.sightings(40_000, [0.1, 0.2], [2.0, 2.0], [3, "door"], [True, True]),
            "frame at 40000 us, sighting 1: label 'door': allowed is a whole number from -1 to 2147483647",
        ),
        (lambda s: s.sightings(40_000, [0.1], [2.0], [2**40], [True]), f"sighting 0: label {2**40}: allowed"),
        (
            lambda s: s.sightings(40_000, [0.1, 0.2], [1.0], [1, 2], [True, True]),
            "frame at 40000 us: 1 values of range_m; allowed: 2, as of bearing_rad",
        ),
        (lambda s: s.sightings(40_000, *ONE, [0.1, 0.1]), "2 values of bearing_sd_rad; allowed: 1"),
        (
            lambda s: s.sightings(40_000, np.ones((1, 1)), *ONE[1:]),
            r"bearing_rad of shape \(1, 1\); allowed: a list",
        ),
        (
            lambda s: s.sightings(40_000, 0.1, *ONE[1:]),
            r"bearing_rad of shape \(\); allowed: a list, one value a",
        ),
        (lambda s: s.sightings(40_000, None, *ONE[1:]), r"bearing_rad of shape \(\); allowed: a list"),
        (lambda s: s.sightings(40_000, *ONE[:3], None), r"mappable of shape \(\); allowed: a list"),
        (lambda s: s.sightings(40_000, *ONE[:3], ["no"]), r"mappable \['no'\]; allowed: True or False"),
        (
            lambda s: s.sightings(40_000, *ONE, signature=np.ones((2, 71))),
            r"shape \(2, 71\); allowed: \(1, 71\)",
        ),
        (
            lambda s: s.sightings(40_000, *ONE, signature=np.full((1, 71), "x")),
            "signatures: .*allowed: numbers",
        ),
        (lambda s: s.sightings(40_000, *ONE, signature=np.full((1, SIGNATURE_SIZE), np.nan)), "BSLAM_E_"),
        (lambda s: s.odometry("wheels", 40_000, np.nan, 0.0), "BSLAM_E_NOT_FINITE"),
        (lambda s: s.odometry("wheels", -1, 0.0, 0.0), "BSLAM_E_TIME"),
        (lambda s: s.sightings(40_000, [np.nan], *ONE[1:]), "BSLAM_E_NOT_FINITE"),
        (lambda s: s.sightings(-10_000_000, *ONE), "BSLAM_E_TIME"),
        (lambda s: s.load_map(None), "map None: allowed are bytes"),
        (lambda s: s.load_map(5), "map 5: allowed are bytes"),
        (lambda s: s.map_fault("a map"), "map 'a map': allowed are bytes"),
        (lambda s: Slam(["wheelbase_m"]), "settings .*allowed is a mapping"),
        (lambda s: Slam(seeds=np.ones((3, 5))), r"signatures of shape \(3, 5\); allowed"),
        (
            lambda s: Slam(seeds=np.full((1, SIGNATURE_SIZE), np.nan)),
            "signature 0 has a value that is no number",
        ),
        (lambda s: Slam(real=["float"]), "scalar type .*allowed are float, double"),
    ],
)
def test_what_is_wrong_is_named_and_changes_nothing(call: Callable[[Slam], object], text: str) -> None:
    slam = started()
    before = without_counters(slam)
    with pytest.raises(BslamError, match=text):
        call(slam)
    assert without_counters(slam) == before


def refused_and_the_same(call: Callable[..., object], bad: object) -> None:
    slam = started()
    before = without_counters(slam)
    with pytest.raises(BslamError, match="allowed"):
        call(slam, bad)
    assert without_counters(slam) == before


def without_counters(slam: Slam) -> tuple[object, ...]:
    """All that a refusal must leave as it was."""
    beacons = [(one.uid, one.x_m, one.y_m, one.covariance_m2.tolist()) for one in slam.beacons()]
    return slam.pose(), slam.pose_covariance_lower(), beacons, slam.params
