"""Kept maps on the host: the bytes of docs/MAP.md, their text, and two maps of one place made one."""

import math
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.maps.blob import KeptBeacon, KeptMap, pack, parse
from bslam.maps.merge import merge
from bslam.maps.text import from_json, to_json

STEP_US = 120_000  # ten of them last for the second that a beacon needs
PLACES = np.array([[4.0, 1.0], [3.0, -2.0], [-1.0, 4.0], [6.0, 3.0], [-2.0, -3.0]])


def seen_map(places, labels, looks_of=None, **params):
    """The map of a robot that stands at the origin and sees these beacons ten times."""
    association = {"association": 0} if looks_of is None else {"association": 3, "confirm_window_us": 0}
    slam = Slam({"velocity_states": 0} | association | params)
    random = np.random.default_rng(3)
    bearing = np.arctan2(places[:, 1], places[:, 0])
    far = np.hypot(places[:, 0], places[:, 1])
    for step in range(10):
        signature = None
        if looks_of is not None:
            noise = 0.02 * random.standard_normal((len(places), 71))
            signature = np.clip(looks_of[labels] + noise, 0, 1).astype(np.float32)
        names = labels if looks_of is None else [-1] * len(places)
        slam.odometry("wheels", STEP_US * step, 0.0, 0.0)
        columns = (bearing.tolist(), far.tolist(), list(names), [True] * len(places))
        slam.sightings(STEP_US * step, *columns, signature=signature)
    return slam.save_map()


def from_elsewhere(places, move):
    """The same places as a robot has them that started at `move`."""
    x, y, theta = move
    back = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    return (places - [x, y]) @ back.T


def assert_same(one, other):
    """But for the rounding of L and D to float32."""
    assert one.beacons == other.beacons
    assert np.array_equal(one.values, other.values)
    sd = np.sqrt(np.diag(other.covariance))
    assert (np.abs(one.covariance - other.covariance) <= 1e-6 * np.outer(sd, sd)).all()
    assert [machine.samples.tolist() for machine in one.machines] == [
        machine.samples.tolist() for machine in other.machines
    ]


@pytest.mark.parametrize("params", [{}, {"range_scale_sd": 0.1}, {"velocity_states": 1}])
def test_the_bytes_are_what_the_library_writes(params):
    blob = seen_map(PLACES, list(range(5)), **params)
    kept = parse(blob)
    assert_same(parse(pack(kept)), kept)
    assert pack(from_json(to_json(kept))) == pack(kept)
    assert [one.label for one in kept.beacons] == [0, 1, 2, 3, 4]
    assert np.allclose([[one.x_m, one.y_m] for one in kept.beacons], PLACES, atol=1e-4)
    slam = Slam(beacons_max=20)
    slam.load_map(blob)
    for one, place, seen in zip(kept.beacons, kept.places(), slam.beacons(), strict=True):
        assert kept.values[place][:2].tolist() == [seen.x_m, seen.y_m]
        assert np.allclose(kept.covariance[place, place][:2, :2], seen.covariance_m2, rtol=1e-5, atol=0)
        assert one.kind == seen.kind


def test_a_covariance_without_an_inverse_is_written_as_it_is():
    kept = parse(seen_map(PLACES[:3], [0, 1, 2]))
    twice = np.eye(6)[[0, 1, 2, 3, 0, 1]]  # the third beacon is the first one again
    twice[3] = 0  # and of the second one value is known
    singular = replace(kept, covariance=twice @ kept.covariance @ twice.T)
    blob = pack(singular)
    assert Slam().map_fault(blob) == "fine"
    assert_same(parse(blob), singular)
    assert parse(blob).covariance[3].tolist() == [0] * 6


@pytest.mark.parametrize(("column", "said"), [(7, "none"), (0xFFFF, "none"), (2, "two")])
def test_columns_that_are_not_a_beacon_s_own_are_refused(column, said):
    blob = bytearray(seen_map(PLACES[:3], [0, 1, 2]))
    blob[28 + 36 : 28 + 38] = struct.pack("<H", column)
    blob[-4:] = struct.pack("<I", zlib.crc32(blob[:-4]))
    with pytest.raises(BslamError, match=f"columns .*{said}"):
        parse(bytes(blob))
    assert Slam().map_fault(bytes(blob)) == "content"


def test_machines_come_back_to_the_same_bytes():
    looks = np.random.default_rng(1).uniform(0, 1, (5, 71))
    blob = seen_map(PLACES, [0, 1, 2, 3, 4], looks)
    kept = parse(blob)
    assert len(kept.machines) == 5
    assert pack(from_json(to_json(kept))) == pack(kept)
    assert_same(parse(pack(kept)), kept)
    for index, machine in enumerate(kept.machines):
        assert (machine.values(machine.samples) > 0).all()
        assert (machine.values(kept.machines[index - 1].samples) < 0).all()


@pytest.mark.parametrize("damage", [lambda b: b[:40], lambda b: b"", lambda b: b[:50] + b"\xff" + b[51:]])
def test_damaged_bytes_are_refused(damage):
    with pytest.raises(BslamError, match="allowed: a map"):
        parse(damage(seen_map(PLACES, list(range(5)))))


@pytest.mark.parametrize("move", [(2.0, -1.0, 0.7), (0.0, 0.0, 3.0), (-5.0, 8.0, -1.5)])
@pytest.mark.parametrize("by_looks", [False, True])
def test_two_maps_of_one_place_become_one(move, by_looks):
    looks = np.random.default_rng(1).uniform(0, 1, (5, 71)) if by_looks else None
    first = parse(seen_map(PLACES[:4], [0, 1, 2, 3], looks))
    second = parse(seen_map(from_elsewhere(PLACES[1:], move), [1, 2, 3, 4], looks))
    both = merge(first, second)
    assert len(both.shared) == 3
    assert both.move == pytest.approx(move, abs=0.01)
    assert len(both.kept.beacons) == 5
    assert np.allclose([[one.x_m, one.y_m] for one in both.kept.beacons], PLACES, atol=0.01)
    slam = Slam(beacons_max=20)
    assert slam.map_fault(pack(both.kept)) == "fine"
    # What both have seen is surer than what one has, and never less sure.
    mine = [np.trace(first.covariance[place, place]) for place in first.places()]
    ours = [np.trace(both.kept.covariance[place, place]) for place in both.kept.places()]
    assert all(ours[i] < mine[i] for i in (1, 2, 3))
    assert ours[0] <= mine[0] + 1e-7  # what merging adds so that exact places have an inverse


def test_a_merged_covariance_is_that_of_least_squares_by_hand():
    """Two points each, both known in both: with equal covariances the merged one is half where it is told."""
    beacons = tuple(KeptBeacon(i, i, "point", 0, None, 9, 0.0, 0.0, 0.0) for i in range(3))
    values = np.array([0.0, 0, 4, 0, 0, 3])
    one = KeptMap(beacons, values, 0.01 * np.eye(6), 3)
    both = merge(one, replace(one))
    # Six values and three of the motion: distances between points are told twice, the rest once.
    by = np.vstack([np.eye(6, 9), np.zeros((6, 9))])
    by[6:, :6] = np.eye(6)
    for k, (x, y) in enumerate(values.reshape(-1, 2)):
        by[6 + 2 * k : 8 + 2 * k, 6:] = [[-1, 0, y], [0, -1, -x]]
    expected = np.linalg.inv(by.T @ by / 0.01)[:6, :6]
    assert np.allclose(both.kept.covariance, expected, atol=1e-6)


def test_maps_that_share_nothing_or_fit_in_two_ways_are_refused():
    first = parse(seen_map(PLACES[:3], [0, 1, 2]))
    with pytest.raises(BslamError, match="share too little"):
        merge(first, parse(seen_map(PLACES[2:], [7, 8, 9])))
    with pytest.raises(BslamError, match="share too little"):
        merge(first, parse(seen_map(PLACES[:1], [0])))
    square = np.array([[2.0, 2.0], [2.0, -2.0], [-2.0, 2.0], [-2.0, -2.0]])
    nameless = replace(parse(seen_map(square, [0, 1, 2, 3])))
    nameless = replace(nameless, beacons=tuple(replace(one, label=-1) for one in nameless.beacons))
    with pytest.raises(BslamError, match="two ways"):
        merge(nameless, nameless)


def test_the_command_shows_exports_imports_and_merges(tmp_path, capsys):
    one, two, both = (tmp_path / f"{name}.bslam" for name in ("one", "two", "both"))
    one.write_bytes(seen_map(PLACES[:4], [0, 1, 2, 3]))
    two.write_bytes(seen_map(from_elsewhere(PLACES[1:], (1.0, 2.0, 0.5)), [1, 2, 3, 4]))
    assert main(["map", "show", str(one), "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "4.00   1.00" in shown
    assert (tmp_path / "one.png").read_bytes()[:4] == b"\x89PNG"
    assert main(["map", "export", str(one), str(tmp_path / "one.json")]) == 0
    assert main(["map", "import", str(tmp_path / "one.json"), str(tmp_path / "again.bslam")]) == 0
    assert_same(parse((tmp_path / "again.bslam").read_bytes()), parse(one.read_bytes()))
    assert main(["map", "merge", str(one), str(two), str(both)]) == 0
    assert "3 beacons in both" in capsys.readouterr().out
    assert len(parse(both.read_bytes()).beacons) == 5


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["show", "bad.bslam"], "bad crc"),
        (["show", "none.bslam"], "cannot be read"),
        (["merge", "good.bslam", "good.bslam"], "MAP MAP MAP"),
        (["import", "bad.json", "out.bslam"], "no key 'format'"),
        (["merge", "good.bslam", "other.bslam", "out.bslam"], "share too little"),
    ],
)
def test_what_is_bad_is_named_and_nothing_is_written(tmp_path, monkeypatch, capsys, words, says):
    monkeypatch.chdir(tmp_path)
    good = seen_map(PLACES, list(range(5)))
    (tmp_path / "good.bslam").write_bytes(good)
    (tmp_path / "other.bslam").write_bytes(seen_map(PLACES, list(range(10, 15))))
    (tmp_path / "bad.bslam").write_bytes(good[:60] + bytes([good[60] ^ 1]) + good[61:])
    (tmp_path / "bad.json").write_text("{}")
    assert main(["map", *words]) == 2
    assert says in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out.bslam").exists()


def test_a_map_whose_covariance_fits_by_pairs_only_is_not_written(tmp_path, capsys):
    kept = parse(seen_map(PLACES[:2], [0, 1]))
    together = np.full((4, 4), -0.4) + 1.4 * np.eye(4)
    (tmp_path / "odd.json").write_text(to_json(replace(kept, covariance=together)))
    assert main(["map", "import", str(tmp_path / "odd.json"), str(tmp_path / "odd.bslam")]) == 2
    assert "covariance" in capsys.readouterr().err
    assert not (tmp_path / "odd.bslam").exists()


def test_a_run_leaves_its_map_and_another_starts_in_it_and_replays(tmp_path, capsys):
    first, second, third = (str(tmp_path / name) for name in ("first", "second", "third"))
    words = ["run", "figure3", "--jobs", "1", "--pictures", "0"]
    assert main([*words, "--out", first]) == 0
    kept = f"{first}/figure3_seed0.bslam"
    mapped = {one.uid: (one.x_m, one.y_m) for one in parse(Path(kept).read_bytes()).beacons}
    assert len(mapped) >= 2
    assert main([*words, "--map", kept, "--frozen", "--record", "--out", second]) == 0
    after = parse(Path(second, "figure3_seed0.bslam").read_bytes())
    assert {one.uid: (one.x_m, one.y_m) for one in after.beacons} == mapped
    assert {one.kind for one in after.beacons} == {"known"}
    assert main(["replay", f"{second}/figure3_seed0.mcap", "--pictures", "0", "--out", third]) == 0
    assert "to the bit" in capsys.readouterr().out
    assert main([*words, "--frozen", "--out", second]) == 2
    assert main([*words, "--map", kept, "--recovery", "off", "--out", second]) == 2
    assert main([*words, "--map", "none.bslam", "--out", second]) == 2
