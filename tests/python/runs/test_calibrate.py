"""Odometry against the truth: what was put in comes out."""

from dataclasses import replace

import numpy as np
import pytest

from bslam.calibration.calibrate import as_toml, calibrate
from bslam.errors import BslamError
from bslam.log import Odometry, Truth

DT_S = 0.04
STEPS = 25 * 400


@pytest.fixture
def drive():
    """Speeds and turn rates of 400 s that change every 2 s, (n,) each, and a generator."""
    rng = np.random.default_rng(7)
    v = np.repeat(rng.uniform(0.1, 0.4, STEPS // 50), 50)
    omega = np.repeat(rng.uniform(-0.6, 0.6, STEPS // 50), 50)
    return v, omega, rng


def poses_of(forward_m, turn_rad):
    theta = np.concatenate([[0.0], np.cumsum(turn_rad)])
    course = theta[:-1] + 0.5 * turn_rad
    x = np.concatenate([[0.0], np.cumsum(forward_m * np.cos(course))])
    y = np.concatenate([[0.0], np.cumsum(forward_m * np.sin(course))])
    return x, y, np.remainder(theta + np.pi, 2 * np.pi) - np.pi


def log_of(made, kind, a, b, poses, lead_us=0):
    times_us = made.step_us * np.arange(STEPS + 1, dtype=np.int64)
    rows = slice(1, None) if kind == "wheels" else slice(None)
    if kind == "velocity":
        a, b = np.concatenate([[0.0], a]), np.concatenate([[0.0], b])
    return replace(
        made.circle_log(steps=1),
        odometry=Odometry(kind, times_us[rows], a, b),
        truth=Truth(times_us + lead_us, *poses),
    )


def test_commands_give_scale_noise_and_lead(made, drive):
    v, omega, rng = drive
    noise = rng.standard_normal((STEPS, 2)) * np.array([0.02, 0.05]) * np.sqrt(DT_S)
    poses = poses_of(0.9 * v * DT_S + noise[:, 0], 1.1 * omega * DT_S + noise[:, 1])
    found = calibrate(log_of(made, "velocity", v, omega, poses, lead_us=170_000))
    for name, value in (("forward_scale", 0.9), ("turn_scale", 1.1)):
        assert abs(found.scales[name].value - value) < 3.0 * found.scales[name].error
        assert found.scales[name].error < 0.02
    assert found.lead_us == pytest.approx(170_000, abs=20_000)
    # 200 windows: 5 % standard error.
    assert found.noise["forward_sd_per_sqrt_s"] == pytest.approx(0.02, rel=0.2)
    assert found.noise["turn_sd_per_sqrt_s"] == pytest.approx(0.05, rel=0.2)


def test_wheels_give_scale_without_bias_and_the_noise_of_each(made, drive):
    v, omega, rng = drive
    half_m = 0.5 * made.robot.wheelbase_m
    poses = poses_of(v * DT_S, omega * DT_S)
    left = (v - half_m * omega) * DT_S / 1.05 + rng.standard_normal(STEPS) * 0.3 * DT_S
    right = (v + half_m * omega) * DT_S / 1.05 + rng.standard_normal(STEPS) * 0.6 * DT_S
    found = calibrate(log_of(made, "wheels", left, right, poses))
    for name in ("forward_scale", "turn_scale"):
        assert abs(found.scales[name].value - 1.05) < 3.0 * found.scales[name].error
    assert found.scales["forward_scale"].error < 0.02
    # The residual is scaled with the reading, hence 1.05.
    assert found.noise["left_speed_sd_mps"] == pytest.approx(0.3 * 1.05, rel=0.2)
    assert found.noise["right_speed_sd_mps"] == pytest.approx(0.6 * 1.05, rel=0.2)
    assert found.lead_us == 0


def test_a_log_without_truth_or_with_too_little_is_refused(made, drive):
    v, omega, _ = drive
    log = log_of(made, "velocity", v, omega, poses_of(v * DT_S, omega * DT_S))
    with pytest.raises(BslamError, match="has no truth; allowed: a log with truth"):
        calibrate(replace(log, truth=None))
    columns = (log.truth.time_us, log.truth.x_m, log.truth.y_m, log.truth.theta_rad)
    sparse = Truth(*(column[::1000] for column in columns))
    with pytest.raises(BslamError, match=r"truth covers 0 driven stretches of 2 s; allowed: at least 20"):
        calibrate(replace(log, truth=sparse))


def test_as_toml_has_the_core_s_names(made, drive):
    v, omega, _ = drive
    found = calibrate(log_of(made, "velocity", v, omega, poses_of(v * DT_S, omega * DT_S)))
    lines = as_toml(found, "a log").splitlines()
    assert lines[0].startswith("# Odometry calibrated on a log")
    assert [line.split(" = ")[0] for line in lines[1:]] == list(found.parameters)
    assert float(lines[1].split(" = ")[1]) == pytest.approx(1.0, abs=1e-3)
