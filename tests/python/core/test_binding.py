"""The Python binding says what the C library says: parameters, refusals, accounts, the map."""

import math
import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bslam.core import CoreError, Slam
from bslam.core.builds import SIZE_CLASSES
from bslam.errors import BslamError
from bslam_build import FIRMWARE_DIR
from core import instance
from core.feeding import KINDS, feed
from reference.runs import PARAMS, run

REALS = pytest.mark.parametrize("real", ["float", "double"])

# ---- parameters --------------------------------------------------------------------------------------------


def table_in_c() -> list[tuple[str, float, float, float, bool, str]]:
    """The lines of the tables in the headers: name, default, low, high, is it whole, meaning."""
    headers = ("settings.h", "association/tuning.h")
    text = "".join(Path(FIRMWARE_DIR, "bslam", name).read_text(encoding="utf-8") for name in headers)
    line = re.compile(r'(REAL|INTEGER)\((\w+), ([-\w.]+), ([-\w.]+), ([-\w.]+),\s*"([^"]*)"\)')
    return [
        (name, float(initial), float(low), float(high), kind == "INTEGER", meaning)
        for kind, name, initial, low, high, meaning in line.findall(text.replace("\\\n", " "))
    ]


@REALS
def test_parameters_are_the_tables_in_c(real: str) -> None:
    found = [(p.name, p.default, p.low, p.high, p.is_integer, p.meaning) for p in Slam.parameters(real)]
    assert found == table_in_c()
    assert list(dict.fromkeys(p.group for p in Slam.parameters(real))) == ["settings", "expert", "tuning"]


@REALS
def test_defaults_are_in_force_where_nothing_is_said(real: str) -> None:
    assert Slam(real=real).params == pytest.approx(Slam.defaults(), rel=1e-7)
    assert list(Slam.defaults()) == [line[0] for line in table_in_c()]


def test_defaults_of_whole_numbers_are_ints() -> None:
    whole = {p.name for p in Slam.parameters() if p.is_integer}
    assert {name for name, value in Slam.defaults().items() if isinstance(value, int)} == whole


@REALS
def test_params_given_are_in_force_and_the_rest_stays(real: str) -> None:
    given = {"wheelbase_m": 0.75, "confirm_sightings": 7, "filter": 0}
    expected = {**Slam.defaults(), **given}
    assert Slam(given, real=real).params == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("parameter", Slam.parameters(), ids=lambda p: p.name)
def test_params_value_outside_its_range_is_named_with_the_range(parameter) -> None:  # type: ignore[no-untyped-def]
    step = 1 if parameter.is_integer else abs(parameter.high) * 0.01
    for wrong in (parameter.low - step, parameter.high + step, math.nan, math.inf, -math.inf):
        with pytest.raises(BslamError) as refusal:
            Slam({parameter.name: wrong})
        for part in (parameter.name, f"{parameter.low:g}", f"{parameter.high:g}"):
            assert part in str(refusal.value)


@REALS
@pytest.mark.parametrize("parameter", Slam.parameters(), ids=lambda p: p.name)
def test_params_limits_of_every_range_are_taken(real: str, parameter) -> None:  # type: ignore[no-untyped-def]
    # With both kinds of further states off, no limit contradicts another value.
    base = {"velocity_states": 0, "scale_states": 0}
    for limit in (parameter.low, parameter.high):
        slam = Slam({**base, parameter.name: limit}, real=real)
        assert slam.params[parameter.name] == pytest.approx(limit, rel=1e-7)


def test_params_fraction_of_a_whole_number_is_refused() -> None:
    with pytest.raises(
        BslamError, match=r"confirm_sightings = 2\.5: allowed is a whole number from 1 to 1000"
    ):
        Slam({"confirm_sightings": 2.5})


def test_params_unknown_name_is_refused_with_the_nearest_ones() -> None:
    others = "that `bslam params --all` lists"
    for name, near in {"wheelbase": "wheelbase_m or another", "nothing like it": "one"}.items():
        with pytest.raises(BslamError, match=f"'{name}' does not exist; allowed: {near} {others}"):
            Slam({name: 0.4})


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("scale_states", 1, "0"),
        ("left_speed_sd_mps", 0.0, "a number above 0"),
        ("right_speed_sd_mps", 0.0, "a number above 0"),
    ],
)
def test_params_that_contradict_each_other_are_both_named(name: str, value: float, allowed: str) -> None:
    message = f"{name} = {value:g} contradicts velocity_states = 1: allowed beside it is {allowed}"
    with pytest.raises(CoreError, match=message) as refusal:
        Slam({"velocity_states": 1, name: value})
    assert refusal.value.status == "BSLAM_E_PARAMETER"


@pytest.mark.parametrize(
    ("params", "message"),
    [
        (
            {"range_sd_floor_m": 0.0, "range_sd_fraction": 0.0, "range_sd_per_m": 0.0},
            "distances without noise",
        ),
        (
            {"counter_modulus": 2},
            "counter_modulus = 2 tells no direction: allowed are 0 and whole numbers from 3",
        ),
    ],
)
def test_params_within_their_ranges_that_cannot_be_are_named(params: dict[str, float], message: str) -> None:
    with pytest.raises(CoreError, match=message) as refusal:
        Slam(params)
    assert refusal.value.status == "BSLAM_E_PARAMETER"


def test_slam_numbers_of_beacons_that_no_build_holds_are_refused() -> None:
    for beacons_max in (-1, 0, max(SIZE_CLASSES) + 1):
        with pytest.raises(BslamError, match=f"{beacons_max} beacons: allowed are 1 to {max(SIZE_CLASSES)}"):
            Slam(beacons_max=beacons_max)


def test_slam_unknown_scalar_type_is_refused() -> None:
    with pytest.raises(BslamError, match="allowed are float, double"):
        Slam(real="half")


@pytest.mark.parametrize("size", SIZE_CLASSES)
def test_slam_holds_as_many_beacons_as_asked(size: int) -> None:
    slam = Slam(beacons_max=size)
    for label in range(size):
        slam.add_known_beacon(label, 1.0 + label, 0.0)
    assert len(slam.beacons()) == size


@pytest.mark.parametrize("size", SIZE_CLASSES)
def test_sightings_of_all_beacons_at_once_and_some_clutter_fit(size: int) -> None:
    slam, count = Slam(beacons_max=size), min(size + 16, 250)  # the core takes no more in a frame
    bearing_rad = np.linspace(-3.0, 3.0, count).tolist()
    accounts = slam.sightings(0, bearing_rad, [2.0] * count, list(range(count)), [True] * count)
    assert [one.result for one in accounts] == ["new"] * size + ["rejected"] * (count - size)


# ---- refusals ----------------------------------------------------------------------------------------------

ONE = ([0.1], [2.0], [3], [True])


def started(params: dict[str, float] | None = None) -> Slam:
    """An instance whose odometry has begun, and that has mapped beacon 3."""
    slam = Slam(params or {"velocity_states": 0})
    slam.odometry("wheels", 0, 0.0, 0.0)
    slam.sightings(0, *ONE)
    return slam


def sighting(**changes: float) -> Callable[[Slam], object]:
    """A frame of two sightings whose second is changed."""
    bad = {"bearing_rad": 0.1, "range_m": 2.0, "label": 4, **changes}
    return lambda slam: slam.sightings(
        40_000, [0.2, bad["bearing_rad"]], [2.0, bad["range_m"]], [3, int(bad["label"])], [True, True]
    )


def fill(slam: Slam) -> None:
    for label in range(100, 120):
        slam.add_known_beacon(label, 1.0, float(label))


def without_noise() -> Slam:
    """Velocity states with a noise whose square is zero in float: no refusal of the parameters, but of
    readings."""
    return started({"velocity_states": 1, "left_speed_sd_mps": 1e-30, "right_speed_sd_mps": 1e-30})


def damaged() -> Slam:
    """A guarded instance in whose memory a bit has flipped."""
    slam = started({"guard": 1})
    at = slam.state_bytes.find(struct.pack("=f", slam.beacons()[0].x_m))
    slam.memory[at] ^= 1
    return slam


REFUSALS: list[tuple[str, Callable[[], Slam], Callable[[Slam], object], str]] = [
    ("BSLAM_E_TIME", started, lambda s: s.odometry("wheels", 0, 0.0, 0.0), "odometry at 0 us"),
    ("BSLAM_E_TIME", started, lambda s: s.odometry("wheels", 10_000_000, 0.0, 0.0), "odometry at 10000000"),
    ("BSLAM_E_TIME", started, lambda s: s.sightings(0, *ONE), "frame at 0 us"),
    ("BSLAM_E_TIME", started, lambda s: s.pose_at(10_000_000), "pose at 10000000 us"),
    ("BSLAM_E_NOT_FINITE", started, lambda s: s.odometry("wheels", 40_000, math.nan, 0.0), "left_m nan"),
    ("BSLAM_E_NOT_FINITE", started, lambda s: s.odometry("velocity", 40_000, math.inf, 0.0), "v_mps inf"),
    ("BSLAM_E_NOT_FINITE", started, sighting(bearing_rad=math.nan), "sighting 1"),
    ("BSLAM_E_NOT_FINITE", started, sighting(range_m=math.inf), "sighting 1"),
    ("BSLAM_E_NOT_FINITE", started, lambda s: s.add_known_beacon(9, math.nan, 0.0), "known beacon 9"),
    ("BSLAM_E_RANGE", started, sighting(range_m=-1.0), "sighting 1"),
    ("BSLAM_E_RANGE", started, sighting(label=-2), "sighting 1"),
    ("BSLAM_E_RANGE", started, lambda s: s.odometry("ticks", 40_000, 2**31, 0), "left_ticks 2147483648"),
    ("BSLAM_E_RANGE", started, lambda s: s.add_known_beacon(-1, 0.0, 0.0), "known beacon -1"),
    ("BSLAM_E_RANGE", started, lambda s: s.resume_odometry(-1.0, 0.0), "resume with sd -1.0 m"),
    ("BSLAM_E_JUMP", started, lambda s: s.odometry("wheels", 40_000, 1e3, 0.0), "left_m 1000.0"),
    ("BSLAM_E_COUNT", started, lambda s: s.sightings(40_000, *([v[0]] * 65 for v in ONE)), "65 sightings"),
    ("BSLAM_E_MAP_FULL", started, fill, "known beacon 119"),
    ("BSLAM_E_NO_BEACON", started, lambda s: s.remove_beacon(77), "beacon 77"),
    ("BSLAM_E_MAP", started, lambda s: s.load_map(b"BSLM"), "map of 4 bytes: truncated"),
    ("BSLAM_E_RANGE", started, lambda s: s.set_pose(0.0, 0.0, 0.0, 31.0, 0.1), "sd 31.0 m"),
    ("BSLAM_E_DUPLICATE", started, lambda s: s.add_known_beacon(3, 0.0, 0.0), "known beacon 3"),
    ("BSLAM_E_STATE", damaged, lambda s: s.odometry("wheels", 40_000, 0.0, 0.0), "odometry at 40000"),
    ("BSLAM_E_STATE", started, lambda s: s.restart(0.1, 0.1), "restart with sd 0.1 m"),
    (
        "BSLAM_E_SINGULAR",
        without_noise,
        lambda s: s.odometry("wheels", 40_000, 0.0, 0.0),
        "odometry at 40000",
    ),
]
EVERY_REFUSAL = pytest.mark.parametrize(
    ("status", "make", "call", "text"), REFUSALS, ids=[f"{status}-{text}" for status, _, _, text in REFUSALS]
)


@EVERY_REFUSAL
def test_refusal_raises_its_status_and_says_what(
    status: str, make: Callable[[], Slam], call: Callable[[Slam], object], text: str
) -> None:
    slam = make()
    with pytest.raises(CoreError) as refusal:
        call(slam)
    assert refusal.value.status == status
    assert text in str(refusal.value) and status in str(refusal.value)
    assert isinstance(refusal.value, BslamError)


def test_every_status_has_a_case() -> None:
    names = set(Slam()._raw.enum_names("bslam_status_t", "").values())
    covered = {case[0].lower() for case in REFUSALS} | {"bslam_e_parameter", "bslam_e_size"}
    assert names - {"bslam_ok", "bslam_status_count"} == covered


@EVERY_REFUSAL
def test_refusal_changes_no_byte_of_the_state(
    status: str, make: Callable[[], Slam], call: Callable[[Slam], object], text: str
) -> None:
    slam = make()
    if call is fill:
        fill_but_one(slam)
    before = instance.state_without_counters(slam)
    with pytest.raises(CoreError, match=status):
        call(slam)
    assert instance.state_without_counters(slam) == before, text


def fill_but_one(slam: Slam) -> None:
    """A full map, so that the first call of `fill` is the refused one."""
    for label in range(200, 219):
        slam.add_known_beacon(label, 1.0, float(label))


# ---- results -----------------------------------------------------------------------------------------------


def test_sightings_accounts_say_what_became_of_each() -> None:
    slam = Slam({"association": 0, "gate_d2": 25.0, "velocity_states": 0})
    slam.add_known_beacon(7, 4.0, 0.0)
    bearings, ranges = [0.5, 0.5, 0.5, 0.5, 2.0], [3.0, 3.0, 3.0, math.nan, 4.0]
    labels, mappable = [1, 1, -1, 2, 7], [True, True, True, False, True]
    accounts = slam.sightings(0, bearings, ranges, labels, mappable)
    assert [(a.result, a.reason) for a in accounts] == [
        ("new", "none"),
        ("rejected", "duplicate"),
        ("rejected", "no_identity"),
        ("rejected", "class"),
        ("rejected", "gate"),
    ]
    assert [a.beacon_uid for a in accounts] == [1, None, None, None, 0]
    assert [a.weight for a in accounts] == [1.0, 0.0, 0.0, 0.0, 0.0]
    gated = accounts[4].test_ratio
    assert accounts[0].test_ratio is None and gated is not None and gated > 1
    matched = slam.sightings(1, [0.5], [3.0], [1], [True])[0]
    assert (matched.result, matched.beacon_uid) == ("matched", 1)
    assert matched.test_ratio == pytest.approx(0.0, abs=1e-6)


def test_beacons_are_those_of_the_state() -> None:
    params = {**PARAMS, **KINDS[10]}
    slam = Slam(params, real="double")
    slam.add_known_beacon(99, -3.0, 4.0)
    for step in run(1, 30, 6, params):
        feed(slam, step)
    known, *others = slam.beacons()
    assert (known.kind, known.label, known.confirmed) == ("known", 99, True)
    assert (known.range_m, known.phi_rad) == pytest.approx((5.0, math.atan2(4, -3)))
    assert not known.covariance_m2.any()
    mean, p = instance.mean(slam), instance.covariance(slam)
    at = 5
    for beacon in others:
        if beacon.kind == "point":
            assert (beacon.x_m, beacon.y_m) == tuple(mean[at : at + 2])
            assert np.allclose(beacon.covariance_m2, p[at : at + 2, at : at + 2], rtol=1e-9, atol=1e-15)
        else:
            x, y, direction, inverse = mean[at : at + 4]
            expected = (x + math.cos(direction) / inverse, y + math.sin(direction) / inverse)
            assert (beacon.x_m, beacon.y_m) == pytest.approx(expected, abs=1e-12)
            assert (np.linalg.eigvalsh(beacon.covariance_m2) > 0).all()
        at += 2 if beacon.kind == "point" else 4
    assert at == instance.dim(slam)
    assert {beacon.kind for beacon in others} == {"point", "ray"}


def test_pose_and_its_covariance_are_those_of_the_state() -> None:
    params = {**PARAMS, **KINDS[7]}
    slam = Slam(params, real="double")
    for step in run(2, 30, 6, params):
        feed(slam, step)
    assert slam.pose() == tuple(instance.mean(slam)[:3])
    assert np.allclose(slam.pose_covariance(), instance.covariance(slam)[:3, :3], rtol=1e-9, atol=1e-15)
    assert slam.pose_at(29 * 40_000) == pytest.approx(slam.pose(), abs=1e-12)


def test_counters_are_those_of_the_struct_and_count() -> None:
    slam = started()
    slam.sightings(40_000, *ONE)
    counters = slam.counters()
    assert counters["odometry"] == 1 and counters["frames"] == 2 and counters["matched"] == 1
    assert all(isinstance(value, int) for value in counters.values())


def test_odometry_gyro_is_taken_beside_the_wheels() -> None:
    params = {"velocity_states": 0, "motion": 1, "gyro_sd_radps": 1e-6}
    with_gyro, without = started(params), started(params)
    with_gyro.odometry("wheels", 40_000, 0.01, 0.01, gyro_radps=0.5)
    without.odometry("wheels", 40_000, 0.01, 0.01)
    # A gyro that is all but exact decides the turn.
    assert with_gyro.pose()[2] == pytest.approx(0.02, abs=1e-5)
    doubtful = started(params)  # its own noise goes before the parameter
    doubtful.odometry("wheels", 40_000, 0.01, 0.01, gyro_radps=0.5, gyro_sd_radps=100.0)
    assert abs(doubtful.pose()[2]) < 1e-3
    with pytest.raises(CoreError, match="BSLAM_E_RANGE"):
        doubtful.odometry("wheels", 80_000, 0.01, 0.01, gyro_radps=0.5, gyro_sd_radps=-0.1)
    assert without.pose()[2] == 0.0


def test_odometry_sources_agree_on_the_same_motion() -> None:
    ticks, radius_m, wheelbase_m = 1000, 0.05, 0.4
    params = {
        "velocity_states": 0,
        "wheelbase_m": wheelbase_m,
        "left_radius_m": radius_m,
        "right_radius_m": radius_m,
        "ticks_per_revolution": ticks,
    }
    per_tick = 2 * math.pi * radius_m / ticks
    left_m, right_m = 30 * per_tick, 40 * per_tick
    readings = {
        "ticks": (30, 40),
        "wheels": (left_m, right_m),
        "velocity": ((left_m + right_m) / 2 / 0.04, (right_m - left_m) / wheelbase_m / 0.04),
    }
    poses = []
    for kind, reading in readings.items():
        slam = Slam(params, real="double")
        slam.odometry(kind, 0, 0, 0)
        slam.odometry(kind, 40_000, *reading)
        poses.append(slam.pose())
    assert poses[1] == pytest.approx(poses[0], abs=1e-12)
    assert poses[2] == pytest.approx(poses[0], abs=1e-12)
