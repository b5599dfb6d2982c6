"""Which sightings and which options each method gets."""

from types import SimpleNamespace

import numpy as np
import pytest

from bslam.experiment.camera import TOLD_THRESHOLD, UNTOLD_THRESHOLD
from bslam.log import Sightings
from measure_association import UsedRows, UsedSource, options_of, parse, source_of, without_clutter


def source(method, *words):
    return source_of(parse(["pairs", "--sensor", "camera", *words]), "pairs", 3, 0.6, method)


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


def test_only_a_camera_has_what_is_used_of_it():
    assert parse(["pairs", "--sensor", "camera", "--methods", "used"]).methods == ["used"]
    with pytest.raises(SystemExit):
        parse(["pairs", "--methods", "used"])


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
