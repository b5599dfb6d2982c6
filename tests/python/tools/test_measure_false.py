"""What wrong associations are made of, and the judge that knows the truth."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from bslam.log import Truth
from measure_false import (
    Books,
    Drive,
    Thing,
    are_beacons,
    cues_of,
    print_bound,
    print_machines,
    print_wrong,
    size_error,
)


@dataclass(frozen=True)
class Account:
    result: str
    beacon_uid: int
    reason: str = "none"
    test_ratio: float = 0.0


def books_of(*frames):
    """Of frames of (true identity, account), all beacons of the map with uids 1 to 3."""
    books = Books()
    beacons = [SimpleNamespace(uid=uid) for uid in (1, 2, 3)]
    books.step(0, (0.0, 0.0, 0.0), SimpleNamespace(beacons=lambda: beacons))
    for frame in frames:
        ids, accounts = zip(*frame, strict=True)
        books.frame(0, ids, (), accounts)
    return books


def test_each_wrong_match_is_told_by_what_met_what():
    books = books_of(
        [(7, Account("new", 1)), (-1, Account("new", 2)), (8, Account("new", 3))],
        [(7, Account("matched", 1, test_ratio=0.2)), (-1, Account("matched", 2)), (8, Account("matched", 1))],
        [(-1, Account("matched", 3)), (7, Account("matched", 2)), (-1, Account("rejected", 0))],
    )
    assert books.wrong == {
        "clutter, its own beacon": 1,
        "a beacon, another": 1,
        "clutter, a beacon": 1,
        "a beacon, false one": 1,
    }
    assert books.sightings == 9
    assert [(one.identity, one.rows) for one in books.things()] == [
        (7, [0, 3, 5]),
        (-1, [1, 4, 7]),
        (8, [2, 6]),
    ]
    assert books.things()[0].test_ratio == [0.2, 0.0]


def test_the_size_of_a_thing_is_told_by_how_it_moves_across_the_view():
    time_us = np.arange(0, 5_000_000, 100_000)
    x_m = np.linspace(0.0, 2.0, len(time_us))
    zero = np.zeros(len(time_us))
    bearing_rad, range_m = np.arctan2(3.0, 1.0 - x_m), np.hypot(3.0, 1.0 - x_m)
    sightings = SimpleNamespace(time_us=time_us, bearing_rad=bearing_rad, range_m=1.3 * range_m)
    robot = SimpleNamespace(sensor_x_m=0.0, sensor_y_m=0.0)
    log = SimpleNamespace(truth=Truth(time_us, x_m, zero, zero), sightings=sightings, robot=robot)
    assert abs(size_error(log, np.arange(len(time_us))) - 0.3) < 1e-6
    assert size_error(log, np.array([3, 3])) == 0.0


def drive_of(*rows):
    """Of things as (identity, sightings, features)."""
    things = [Thing(identity, list(range(count))) for identity, count, _ in rows]
    table = np.array([features for _, _, features in rows])
    books = Books()
    books.sightings = 100
    return Drive(books, things, table, {identity for identity, _, _ in rows if identity >= 0})


def test_of_two_with_one_identity_the_one_seen_more_is_the_beacon():
    row = [20.0, 1.0, 0.0, 0.1, 1.0]
    assert are_beacons(drive_of((4, 9, row), (4, 12, row), (-1, 30, row))).tolist() == [False, True, False]


def test_the_judge_gets_right_what_a_threshold_parts_and_no_more(capsys):
    drives = [
        drive_of((1, 40, [50.0, 2.0, 0.01, 0.1, 1.0]), (-1, 10, [50.0, 0.3, 0.4, 0.1, 6.0])),
        drive_of((1, 40, [60.0, 1.8, 0.02, 0.2, 1.0]), (-1, 10, [60.0, 0.4, 0.5, 0.2, 6.0])),
    ]
    print_wrong(drives)
    print_bound(drives)
    rows = dict(
        line.strip("| ").split(" | ", 1) for line in capsys.readouterr().out.splitlines() if " | " in line
    )
    assert rows["score"] == "0 | 0 | 2 of 2 | 0.00"
    assert "0 of 2" in rows["places"]


def test_a_machine_is_taught_by_the_other_drives_alone(capsys):
    beacon, false = [60.0, 1.0, 0.0, 0.02, 1.0], [12.0, 1.0, 0.0, 0.02, 6.0]
    odd = [
        12.0,
        1.0,
        0.0,
        0.02,
        6.0,
    ]  # beacons with the cues of the others' clutter
    plain = [drive_of((1, 40, beacon), (-1, 10, false)) for _ in range(3)]
    print_machines([*plain, drive_of((1, 40, beacon), *((identity, 40, odd) for identity in range(2, 12)))])
    rows = dict(
        line.strip("| ").split(" | ", 1) for line in capsys.readouterr().out.splitlines() if " | " in line
    )
    assert rows["places, kind"].startswith("10 | ")


def test_a_machine_weighs_logarithms_and_a_bit_for_each_kind():
    table = cues_of(np.array([[20.0, 0.5, 0.3, 0.99, 2.0]]), ["places", "score", "offsets", "kind"])
    assert np.allclose(table, [[np.log(20.0), 0.5, 0.0, 0, 1, 0, 0, 0, 0, 0]])
