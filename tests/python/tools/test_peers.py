"""tools/bench/peers: the drives that other people's programs get are those that bslam gets."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from bslam.evaluation.metrics import evaluate
from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.runs.runner import run_log
from tools.bench import bench
from tools.bench.peers.drives import circle, simulated, text
from tools.bench.peers.programs import CORE, PEERS, run

OPTIONS = RunOptions(velocity_states=False)
BEACONS = 20


@pytest.fixture(scope="module")
def core():
    return CORE.build(BEACONS)


def own(log):
    """Mean error and beacons of the same core by way of Python."""
    trace = run_log(log, OPTIONS)
    evaluation = evaluate(log, trace, OPTIONS)
    return evaluation.error_m[1:].mean(), len(trace.beacons)


@pytest.mark.parametrize("log", [circle(BEACONS, 50), first_steps(simulated("paper_room", 3), 300)])
def test_core_as_a_program_does_what_it_does_elsewhere(core, log):
    got = run(core, CORE.words, text(log, 30))
    error_m, beacons = own(log)
    # Noise comes by way of a step's travel and back: the last bit of a parameter may differ.
    assert got.error_m == pytest.approx(error_m, rel=1e-4)
    assert got.landmarks == beacons
    assert got.kept_bytes > 10_000 and got.step_ns > 0


def test_without_identities_nobody_is_told_any(core):
    log = first_steps(simulated("paper_room", 3), 300)
    blind = text(log, 30, identities=False)
    labels = [line.split()[0] for line in blind.splitlines() if len(line.split()) == 3]
    assert set(labels) == {"-1"}
    assert run(core, [*CORE.words, *CORE.by_distance], blind).landmarks >= 3


def test_circle_shows_every_beacon_and_then_two_to_four(core):
    log = circle(BEACONS, 6)
    _, counts = np.unique(log.sightings.time_us, return_counts=True)
    assert counts.tolist() == [8, 8, 8, 2, 3, 4, 2, 3, 4]
    assert set(log.sightings.beacon_id.tolist()) == set(range(BEACONS))


def test_broken_drive_is_refused_with_its_reason(core):
    with pytest.raises(SystemExit, match="cut short"):
        run(core, CORE.words, "\n".join(text(circle(BEACONS, 3), 3).splitlines()[:-1]))
    with pytest.raises(SystemExit, match="no_such_parameter"):
        run(core, ["no_such_parameter=1"], text(circle(BEACONS, 3), 3))


@pytest.mark.parametrize("peer", PEERS, ids=lambda one: one.name)
def test_peer_reaches_about_the_same(core, peer):
    if not peer.is_here():
        pytest.skip(f"apt-get install {peer.package}")
    log = circle(BEACONS, 100)
    got, wanted = (run(one.build(BEACONS), one.words, text(log, 100)) for one in (peer, CORE))
    assert got.landmarks == BEACONS
    assert got.error_m == pytest.approx(wanted.error_m, rel=0.2)


def test_what_is_not_installed_is_named_with_its_command(monkeypatch):
    nowhere = tuple(replace(one, is_here=lambda: False) for one in PEERS)
    monkeypatch.setattr(bench, "PEERS", nowhere)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    found = bench.missing()
    assert found["MRPT, Davison"] == "apt-get install libmrpt-slam-dev"
    assert found["GTSAM"] == "pip install gtsam" and found["m2cgen"] == "pip install m2cgen"
