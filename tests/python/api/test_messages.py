"""Every message says what is allowed, and the nearest right name."""

from pathlib import Path

import numpy as np
import pytest

import bslam
from api.tables import DRIVE
from bslam import BslamError, CoreError, Slam
from bslam.core.vision import FrontEnd
from bslam.errors import did_you_mean
from bslam.options import RunOptions
from bslam.rig import load_rig

NAN = float("nan")


def following() -> Slam:
    slam = Slam({"velocity_states": 0})
    slam.odometry("wheels", 0, 0.0, 0.0)
    slam.sightings(0, [], [], [], [])
    slam.odometry("wheels", 40_000, 0.01, 0.01)
    return slam


@pytest.mark.parametrize(
    ("word", "allowed", "said"),
    [
        ("wheel", ["wheels", "ticks"], "; did you mean 'wheels'?"),
        ("GATE-D2", ["gate_d2", "huber_d"], "; did you mean 'gate_d2'?"),
        ("xyz", ["wheels", "ticks"], ""),
        ("", ["wheels"], ""),
        ("wheel", [], ""),
    ],
)
def test_nearest_name(word, allowed, said) -> None:
    assert did_you_mean(word, allowed) == said


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: Slam({"gate_d": 3.0}), "'gate_d2'"),
        (lambda: Slam({"wheelbase": 3.0}), "'wheelbase_m'"),
        (lambda: Slam(real="flaot"), "'float'"),
        (lambda: Slam().odometry("wheel", 0, 0, 0), "'wheels'"),
        (lambda: bslam.simulate("paper_rom"), "'paper_room'"),
        (lambda: bslam.simulate("paper_room", noise="actuaton"), "'actuation'"),
        (lambda: DRIVE.run(asociation="known"), "'association'"),
        (lambda: DRIVE.run(gate_d2=9.0), r"parameters={'gate_d2': ...}"),
        (lambda: DRIVE.run(parameters={"gate_d": 9.0}), "'gate_d2'"),
        (lambda: DRIVE.run(presets=("bearing_only",)), "'bearing-only'"),
        (lambda: RunOptions(association="mahalanobi"), "'mahalanobis'"),
        (lambda: RunOptions(filter="Invariant"), "'invariant'"),
        (lambda: RunOptions(observation="directions"), "'direction'"),
        (lambda: RunOptions(align="rigd"), "'rigid'"),
        (lambda: RunOptions(noise="actuator"), "'actuation'"),
    ],
)
def test_a_misspelt_name_is_met_with_the_nearest(call, name) -> None:
    with pytest.raises(BslamError) as refusal:
        call()
    message = str(refusal.value)
    assert "allowed" in message and message.endswith(f"; did you mean {name}?") and "\n" not in message


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: Slam({"gate_d2": -1.0}), "gate_d2 = -1.0: allowed is a number from 0 to 1e+06"),
        (lambda: Slam({"wheelbase_m": "0.3"}), "wheelbase_m = '0.3': allowed is a number from 0.001 to 10"),
        (
            lambda: DRIVE.run(parameters={"gate_d2": -1.0}),
            "gate_d2 = -1.0: allowed is a number from 0 to 1e+06",
        ),
        (lambda: DRIVE.run(parameters=[9.0]), "allowed is a mapping"),
        (
            lambda: DRIVE.run(sigma_mps=-1.0),
            "sigma_mps: -1.0 is not allowed; allowed: a number from 0 to 100",
        ),
        (lambda: DRIVE.run(seed=0.5), "seed: 0.5 is not allowed; allowed: an integer from 0"),
        (lambda: DRIVE.run(presets="paper"), "presets: 'paper' is not allowed; allowed: a tuple of names"),
        (
            lambda: bslam.simulate("paper_room", seed="x"),
            "seed: 'x' is not allowed; allowed: an integer from 0",
        ),
        (lambda: DRIVE.run(association=5), "association: 5 is not allowed; allowed: a text, or None"),
        (lambda: DRIVE.run(target=5), "target: 5 is not allowed; allowed: a text, or None"),
        (lambda: DRIVE.run(kept_map=Path("no.bslam")), "no.bslam: "),
        (lambda: DRIVE.run(kept_map=5), "kept_map: 5 is not allowed; allowed: a text, or None"),
        (lambda: DRIVE.run(frozen=True), "frozen: no map; allowed: with kept_map"),
        (lambda: DRIVE.run(kept_map="a.bslam", known_map=True), "with known_map; allowed: one of them"),
        (lambda: DRIVE.run(association="known:2"), "'2' is not a rate; allowed: known, known:RATE with"),
        (
            lambda: following().sightings(40_000, [0.1], [2.0, 3.0], [1], [True]),
            "2 values of range_m; allowed:",
        ),
        (lambda: following().sightings(40_000, [0.1], [2.0], [7.5], [True]), "label 7.5: allowed is a whole"),
    ],
)
def test_what_cannot_be_is_met_with_what_can(call, said) -> None:
    with pytest.raises(BslamError) as refusal:
        call()
    assert said in str(refusal.value)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"bearing_rad": [NAN]}, "bearing_rad nan: allowed is radians from -2 pi to 2 pi"),
        ({"bearing_rad": [90.0]}, "bearing_rad 90.0: allowed is radians from -2 pi to 2 pi"),
        ({"range_m": [-2.0]}, "range_m -2.0: allowed is 0.001 to 10000 m, or NaN for none"),
        ({"range_m": [float("inf")]}, "range_m inf: allowed is"),
        ({"label": [-5]}, "label -5: allowed is a whole number from 0, or -1 for no identity"),
        ({"bearing_sd_rad": [4.0]}, "bearing_sd_rad 4.0: allowed is 0 or 1e-5 to pi"),
        ({"range_sd_m": [1e-4]}, "range_sd_m 0.0001: allowed is 0 or 0.001 to 10000 m"),
        ({"range_scale_sd": [1.5]}, "range_scale_sd 1.5: allowed is 0 to 1"),
        ({"score": [1e7]}, "score 10000000.0: allowed is -1e6 to 1e6"),
        ({"range_m": [NAN], "range_sd_m": [9e9], "score": [NAN]}, "score nan: allowed is -1e6 to 1e6"),
        ({"signature": np.full((1, 71), NAN, np.float32)}, "signature: allowed are finite numbers"),
    ],
)
def test_a_sighting_that_the_core_refuses_is_met_with_its_field(columns, said) -> None:
    good = {"bearing_rad": [0.1], "range_m": [2.0], "label": [3], "mappable": [True]}
    slam = following()
    with pytest.raises(CoreError, match=r"^frame at 40000 us, sighting 0: ") as refusal:
        slam.sightings(40_000, **(good | columns))
    assert said in str(refusal.value)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda s: s.odometry("wheels", 80_000, NAN, 0.0), "allowed is finite numbers"),
        (lambda s: s.odometry("wheels", 80_000, 100.0, 0.0), "a wheel's speed up to speed_max_mps = 20 m/s"),
        (lambda s: s.odometry("wheels", 40_000, 0.0, 0.0), "a stamp in microseconds above the one before"),
        (lambda s: s.odometry("wheels", 40_000_000, 0.0, 0.0), "by up to 4 s (else resume_odometry first)"),
        (lambda s: s.sightings(10**9, [], [], [], []), "at most ahead_max_us = "),
        (
            lambda s: s.sightings(40_000, *[[0.1] * 65] * 2, [1] * 65, [True] * 65),
            "allowed is up to 64",
        ),
        (lambda s: s.pose_at(10**9), "allowed is a stamp within the last readings"),
        (lambda s: s.remove_beacon(99), "beacon 99: allowed is a uid of beacons()"),
        (lambda s: s.set_pose(0.0, 0.0, 0.0, -1.0, 0.1), "allowed is sd from 0 to 30 m"),
        (lambda s: s.add_known_beacon(-1, 0.0, 0.0), "allowed is a label from 0, and a place within 10 km"),
        (lambda s: s.resume_odometry(31.0, 0.1), "allowed is sd from 0 to 30 m and from 0 to 3.2 rad"),
    ],
)
def test_what_else_the_core_refuses_is_met_with_what_is_allowed(call, said) -> None:
    with pytest.raises(CoreError) as refusal:
        call(following())
    assert said in str(refusal.value)


def test_a_picture_of_another_shape_is_met_with_the_right_one() -> None:
    rig = load_rig("wide180")
    lens = rig.cameras[0].lens
    right = rf"\({lens.height_px}, {lens.width_px}, 3\) uint8, or"
    with pytest.raises(BslamError, match=rf"shape \(10, 20, 3\), uint8: allowed for camera 0.*{right}"):
        FrontEnd(rig.cameras).see(np.zeros((10, 20, 3), np.uint8))
