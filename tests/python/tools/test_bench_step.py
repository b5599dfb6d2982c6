"""The filter step on this host: as many instructions as near-optimal code takes, not twice as many."""

import platform

import pytest

from tools.bench import bench

BEACONS = 20
RATIO_MAX = 1.3
"""1.1 with gcc 12; what another compiler does with the same code is within the rest. Without vector
instructions in the covariance's pass, which once went unseen, it is 1.8."""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="the near-optimal count is an x86-64's")
def test_step_takes_no_more_instructions_than_near_optimal_code() -> None:
    counted = bench.instructions_per_step(bench.build(BEACONS), "plain")
    assert counted <= RATIO_MAX * bench.NEAR_OPTIMAL[BEACONS]
