"""Which sightings and which options each method gets."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bslam.experiment.camera import TOLD_THRESHOLD, UNTOLD_THRESHOLD
from bslam.experiment.options import recovery_of
from bslam.log import Sightings
from measure_association import (
    ABLATIONS,
    UsedRows,
    UsedSource,
    options_of,
    parse,
    print_draws,
    ratios,
    row,
    run_all,
    source_of,
    without_clutter,
)


def source(method, *words, draw=0):
    return source_of(parse(["pairs", "--sensor", "camera", *words]), "pairs", 3, 0.6, method, draw)


def test_same_has_known_identity_of_what_the_others_get():
    assert options_of("same", "camera", 0.6, 3).association == "known"
    assert source("known").threshold == TOLD_THRESHOLD
    assert source("same").threshold == source("svm").threshold == UNTOLD_THRESHOLD
    assert source("same", "--score", "0.5").threshold.whole == 0.5


def test_used_has_known_identity_of_what_svm_uses():
    assert options_of("used", "camera", 0.6, 3, [("again_odds", 2.0)]) == options_of("same", "camera", 0.6, 3)
    assert isinstance(source("used"), UsedSource) and not isinstance(source("same"), UsedSource)
    assert source("used").threshold == UNTOLD_THRESHOLD
    rows = UsedRows()
    frames = [["new", "deferred"], [], ["matched", "rejected", "matched"]]
    for results in frames:
        accounts = [SimpleNamespace(result=result, reason="none", beacon_uid=4) for result in results]
        rows.frame(0, [7] * len(results), (), accounts)
    assert rows.rows == [0, 2, 4]


def test_alone_is_svm_that_does_not_notice_when_it_is_lost():
    changes = [("settled_us", 0)]
    svm = options_of("svm", "simulated", 0.6, 3, changes)
    assert options_of("alone", "simulated", 0.6, 3, changes) == replace(svm, recovery="off")
    assert recovery_of(svm) == "growing" and svm.parameters == tuple(changes)
    assert parse(["pairs", "--methods", "alone"]).methods == ["alone"]


def test_a_run_that_fails_ends_the_table_with_its_error(monkeypatch):
    failed = SimpleNamespace(name="pairs_seed3", failed=True, entry={"error": "photographs: not at hand"})
    result = SimpleNamespace(outcomes=[failed], interrupted=False)
    monkeypatch.setattr("measure_association.run_batch", lambda *_: result)
    with pytest.raises(SystemExit, match="pairs_seed3: photographs: not at hand"):
        run_all(parse(["pairs", "--methods", "svm", "--seeds", "3:4"]), 0)


def test_no_ablation_finds_itself_by_looks():
    for method in ABLATIONS:
        assert recovery_of(options_of(method, "simulated", 0.6, 3)) == "off"


def test_only_a_camera_has_what_is_used_of_it():
    assert parse(["pairs", "--sensor", "camera", "--methods", "used"]).methods == ["used"]
    with pytest.raises(SystemExit):
        parse(["pairs", "--methods", "used"])


def entry(error_m, mapped=3):
    counts = dict.fromkeys(("wrong_associations", "missed", "false_new", "deferred"), 0)
    beacons = {"beacons_mapped": mapped, "beacons_true": 3, "map_rmse_m": error_m, "diverged": False}
    return counts | beacons | {"sightings": 10, "position_error_m": {"mean": error_m}}


def test_each_draw_of_the_wheels_noise_is_a_source_of_its_own():
    assert [source("svm", draw=draw).noise_draw for draw in (0, 2)] == [0, 2]
    assert parse(["pairs"]).draws == 1 and parse(["pairs", "--draws", "3"]).draws == 3
    for wrong in ("0", "-1", "two"):
        with pytest.raises(SystemExit):
            parse(["pairs", "--draws", wrong])


def test_a_drive_counts_as_the_mean_of_its_draws(capsys):
    known = [[entry(0.1)] * 3, [entry(0.2)] * 3]  # of three drives
    runs = [[entry(0.1), entry(0.2), entry(0.3)], [entry(0.8), entry(0.4), entry(0.2, mapped=4)]]
    assert ratios(runs[0], known[0]) == pytest.approx([1.0, 2.0, 3.0])
    cells = [cell.strip() for cell in row("svm", runs, known).split("|")]
    assert cells[6] == "5 of 6 (3.2)"
    assert cells[8] == "33.3 ± 26"  # of 45, 30 and 25 cm; Student's t of two degrees of freedom is 4.30
    assert cells[9] == "2.17 ± 0.72"  # of 2.5, 2 and 2
    print_draws({"known": known, "svm": [runs[0], runs[0]]}, known)
    assert "svm, against known in each draw: 2, 1\n" in capsys.readouterr().out


def test_an_ablation_is_svm_with_one_parameter_changed():
    changed = options_of("untrained", "simulated", 0.6, 3, [("again_odds", 2.0)])
    assert changed.association == "svm"
    assert changed.parameters == (("learn_budget", 0), ("again_odds", 2.0))
    assert options_of("same", "simulated", 0.6, 3, [("again_odds", 2.0)]).parameters == ()


def test_without_clutter_every_column_keeps_the_rows_that_show_a_beacon():
    assert source("svm").clutter and not source("svm", "--without-clutter").clutter
    count = np.arange(4)
    left = without_clutter(
        Sightings(
            time_us=count * 1000,
            beacon_id=np.array([5, -1, 0, -1]),
            bearing_rad=count * 0.1,
            range_m=count * 1.0,
            mappable=np.ones(4, np.bool_),
            beacon_class=count + 1,
        )
    )
    assert left.beacon_id.tolist() == [5, 0]
    assert left.time_us.tolist() == [0, 2000]
    assert left.bearing_rad.tolist() == [0.0, 0.2]
    assert left.range_m.tolist() == [0.0, 2.0]
    assert left.beacon_class.tolist() == [1, 3]
    assert len(left.mappable) == 2
    assert left.signature is None
