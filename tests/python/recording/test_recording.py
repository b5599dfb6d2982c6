"""Recordings: what is read is what was written, in a file that any MCAP reader takes."""

import json
import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from zstandard import ZstdCompressor

from bslam.cli import main
from bslam.core.slam import Account, Beacon, Slam
from bslam.errors import BslamError
from bslam.log import Log, first_steps
from bslam.options import RunOptions
from bslam.recording import Recorder, Recording, RecordingWriter, load
from bslam.recording.aslog import as_log
from bslam.recording.entries import (
    FORMATS,
    Call,
    Counters,
    Frame,
    Gap,
    Map,
    Reading,
    Start,
    State,
    TruePose,
)
from bslam.recording.schemas import SCHEMAS
from bslam.runs.rerun import options_of, rerun
from bslam.runs.runner import run_log
from bslam.world.simulate import load_scenario, simulate

floats = st.floats(allow_nan=False, allow_infinity=False)
ranges = st.one_of(floats, st.just(math.nan))
accounts = st.builds(
    Account,
    st.sampled_from(["matched", "new", "rejected", "deferred"]),
    st.sampled_from(["none", "gate"]),
    st.one_of(st.none(), st.integers(0, 2**32 - 1)),
    st.one_of(st.none(), floats),
    floats,
)
times = st.integers(-(2**62), 2**62)


@st.composite
def frames(draw):
    count = draw(st.integers(0, 3))
    rows = {"min_size": count, "max_size": count}
    noisy, signed, classed, known, refused = (draw(st.booleans()) for _ in range(5))
    table = np.random.default_rng(draw(st.integers(0, 9))).standard_normal((count, 71)).astype(np.float32)
    return Frame(
        time_us=draw(times),
        bearing_rad=draw(st.lists(floats, **rows)),
        range_m=draw(st.lists(ranges, **rows)),
        label=draw(st.lists(st.integers(-1, 2**31 - 1), **rows)),
        mappable=draw(st.lists(st.booleans(), **rows)),
        bearing_sd_rad=draw(st.lists(floats, **rows)) if noisy else None,
        range_sd_m=draw(st.lists(floats, **rows)) if noisy else None,
        range_scale_sd=draw(st.lists(floats, **rows)) if noisy and classed else None,
        signature=table if signed else None,
        beacon_class=draw(st.lists(st.integers(0, 254), **rows)) if classed and count else None,
        score=draw(st.lists(floats, **rows)) if classed else None,
        true_id=draw(st.lists(st.integers(-1, 99), **rows)) if known and count else None,
        accounts=None if refused else draw(st.lists(accounts, **rows)),
        refused="BSLAM_E_TIME" if refused else None,
    )


readings = st.one_of(
    st.builds(Reading, st.sampled_from(["wheels", "velocity"]), times, floats, floats, st.none() | floats),
    st.builds(
        Reading,
        st.just("ticks"),
        times,
        st.integers(0, 2**32 - 1),
        st.integers(0, 2**32 - 1),
        refused=st.just("BSLAM_E_TIME"),
    ),
)
beacons = st.builds(
    Beacon,
    uid=st.integers(0, 2**32 - 1),
    label=st.integers(-1, 9),
    kind=st.just("point"),
    confirmed=st.booleans(),
    sightings=st.integers(0, 9),
    x_m=floats,
    y_m=floats,
    covariance_m2=st.just(np.array([[0.1, 0.01], [0.01, 0.3]])),
    range_m=floats,
    phi_rad=floats,
)
poses = st.tuples(floats, floats, floats)
entries = st.one_of(
    readings,
    frames(),
    st.builds(Call, st.just("resume_odometry"), st.tuples(floats, floats), st.none() | st.just("BSLAM_E")),
    st.builds(Call, st.just("load_map"), st.tuples(st.binary()), words=st.just({"frozen": True})),
    st.builds(State, times, poses, st.tuples(*[floats] * 6), st.none() | st.integers(0, 2**64 - 1)),
    st.builds(Map, st.lists(beacons, max_size=2)),
    st.builds(Counters, st.just({"odometry": 3})),
    st.builds(TruePose, times, poses),
    st.builds(TruePose, times, st.tuples(floats, floats, st.just(math.nan))),
    st.builds(Gap, st.integers(1, 9)),
)


def text(entry):
    """An entry's bits; arrays and NaN do not compare by themselves."""
    return repr(
        {
            name: value.tobytes() if isinstance(value, np.ndarray) else value
            for name, value in vars(entry).items()
        }
    )


@given(entries)
def test_an_entry_comes_back_to_the_bit(entry):
    form = FORMATS[type(entry)]
    through = form.read(json.loads(json.dumps(form.write(entry), allow_nan=False)))
    assert text(through) == text(entry)


@pytest.fixture(scope="module")
def log():
    return first_steps(simulate(load_scenario("paper_room"), 3), 120)


@pytest.fixture(scope="module")
def recorded(log, tmp_path_factory):
    """A recording of a run that has everything, and its path."""
    path = tmp_path_factory.mktemp("recording") / "drive.mcap"
    options = RunOptions(association="svm")
    run_log(log, options, record=path)
    return load(path)


def test_any_reader_takes_it_and_every_message_is_as_its_schema_says(recorded):
    topics = set()
    with recorded.path.open("rb") as file:
        last_ns = 0
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            topics.add(channel.topic)
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert message.log_time >= last_ns
            last_ns = message.log_time
            check(json.loads(message.data), json.loads(schema.data), channel.topic)
            assert json.loads(schema.data)["title"] == schema.name
    assert topics >= {"/start", "/odometry", "/sightings", "/state", "/map", "/pose", "/scene", "/true_pose"}


KINDS = {
    "object": dict,
    "array": list,
    "number": (int, float),
    "integer": int,
    "string": str,
    "boolean": bool,
}


def check(value, schema, where):
    """Types as the schema has them, no property that it does not know; null is nothing."""
    if value is None:
        return
    kinds = [schema["type"]] if isinstance(schema["type"], str) else schema["type"]
    assert any(isinstance(value, KINDS[kind]) for kind in kinds), where
    if schema["type"] == "object" and schema["properties"]:
        for name, inner in value.items():
            if name in schema["properties"]:
                check(inner, schema["properties"][name], f"{where}.{name}")
            else:
                assert schema["title"] == "bslam.Start", f"{where}.{name}"
    if schema["type"] == "array":
        for inner in value:
            check(inner, schema["items"], where)


def test_every_kind_of_entry_has_a_schema():
    assert {form.schema for form in FORMATS.values()} <= set(SCHEMAS)


def test_a_rerun_is_the_run_to_the_bit_and_one_flipped_bit_shows(recorded):
    options = options_of(recorded, "host", {})
    trace, found = rerun(recorded, options)
    assert found.same and found.states > 200 and found.lost == 0
    assert trace.steps == 120
    place = next(
        i for i, one in enumerate(recorded.entries) if isinstance(one, State) and one.time_us > 2_000_000
    )
    one = recorded.entries[place]
    other = replace(one, pose=(np.nextafter(np.float32(one.pose[0]), np.float32(9)), *one.pose[1:]))
    spoilt = replace(recorded, entries=(*recorded.entries[:place], other, *recorded.entries[place + 1 :]))
    _, found = rerun(spoilt, options)
    assert (found.different, found.first_us) == (1, one.time_us)


def test_a_rerun_with_other_parameters_differs(recorded):
    _, found = rerun(recorded, options_of(recorded, "host", {"bearing_sd_rad": 0.02}))
    assert found.different > 100


def test_as_a_log_it_is_the_log_it_was_made_from(recorded, log, tmp_path):
    as_log(recorded).write(tmp_path / "through")
    log.write(tmp_path / "made")
    for path in sorted((tmp_path / "made").iterdir()):
        if path.name != "truth.csv":  # its last pose may stand after the last reading
            assert (tmp_path / "through" / path.name).read_bytes() == path.read_bytes(), path.name
    assert Log.read(tmp_path / "through").truth is not None


def test_without_a_robot_the_log_has_what_the_filter_was_told(recorded):
    nameless = replace(recorded, start=replace(recorded.start, robot=None))
    told, robot = as_log(nameless).robot, as_log(recorded).robot
    assert told.wheelbase_m == pytest.approx(robot.wheelbase_m)
    assert told.step_us == robot.step_us
    assert told.range_sigma_scale_m == pytest.approx(robot.range_sigma_scale_m)


def test_refusals_calls_and_a_late_image_are_recorded_and_run_again(tmp_path):
    start = Start("odd", Slam.defaults(), 20)
    with RecordingWriter(tmp_path / "odd.mcap", start) as writer:
        slam = Recorder(Slam(), writer)
        slam.add_known_beacon(7, 2.0, 0.0)
        with pytest.raises(BslamError):
            slam.add_known_beacon(-7, 2.0, 0.0)
        for step in range(1, 40):
            slam.odometry("wheels", step * 40_000, 0.02, 0.02)
        slam.sightings(38 * 40_000, [0.1], [1.0], [7], [True])
        with pytest.raises(BslamError):
            slam.odometry("wheels", 40_000, 0.02, 0.02)
        with pytest.raises(BslamError):
            slam.sightings(10, [0.1], [math.nan], [7], [True])
        slam.resume_odometry(0.1, 0.1)
        slam.odometry("wheels", 60 * 40_000, 0.02, 0.02)
        slam.finish()
    recording = load(tmp_path / "odd.mcap")
    _, found = rerun(recording, options_of(recording, "host", {}))
    assert found.same and found.states == 43
    assert [one.refused for one in recording.entries if isinstance(one, Call)] == [
        None,
        "BSLAM_E_RANGE",
        None,
    ]


def test_a_map_loaded_on_the_way_and_a_pose_that_is_lost_run_again(tmp_path):
    with RecordingWriter(tmp_path / "kept.mcap", Start("kept", Slam.defaults(), 20)) as writer:
        slam = Recorder(Slam(), writer)
        for step in range(1, 30):
            slam.odometry("wheels", step * 40_000, 0.02, 0.02)
            slam.sightings(step * 40_000, [0.1, -0.4], [2.0, 1.5], [7, 8], [True, True])
        blob = slam.save_map()
        slam.lose_pose()
        with pytest.raises(BslamError):
            slam.load_map(blob[:-1])
        slam.load_map(blob, frozen=True)
        slam.set_pose(0.5, 0.0, 0.1, 0.1, 0.05)
        for step in range(30, 60):
            slam.odometry("wheels", step * 40_000, 0.02, 0.02)
            slam.sightings(step * 40_000, [0.1, -0.4], [2.0, 1.5], [7, 8], [True, True])
        slam.finish()
    recording = load(tmp_path / "kept.mcap")
    _, found = rerun(recording, options_of(recording, "host", {}))
    assert found.same and found.states == 2 * 59
    calls = [(one.name, one.refused) for one in recording.entries if isinstance(one, Call)]
    assert calls == [
        ("lose_pose", None),
        ("load_map", "BSLAM_E_MAP"),
        ("load_map", None),
        ("set_pose", None),
    ]


def test_a_file_that_was_cut_is_read_as_far_as_it_goes(recorded, tmp_path):
    data = recorded.path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 3 // 4])
    part = load(cut)
    assert not part.complete and recorded.complete
    assert 0 < len(part.entries) < len(recorded.entries)
    assert list(map(text, part.entries)) == list(map(text, recorded.entries[: len(part.entries)]))


def test_a_replay_of_a_file_that_was_cut_says_so(recorded, tmp_path, capsys):
    data = recorded.path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 3 // 4])
    words = ["--pictures", "0", "--out", str(tmp_path / "out")]
    assert main(["replay", str(tmp_path / "cut.mcap"), *words]) == 0
    assert "cut.mcap: it was cut short; its end is missing" in capsys.readouterr().err
    (tmp_path / "cut.mcap").write_bytes(data[:200])
    with pytest.raises(BslamError, match=r"cut\.mcap: it was cut short, and does not begin with /start"):
        load(tmp_path / "cut.mcap")


def chunked(path, contents, packed="zstd", says=None):
    """An MCAP file whose chunks hold these bytes, and say of themselves what they are asked to."""
    data = b"\x89MCAP0\r\n"
    for content in contents:
        body = ZstdCompressor().compress(content) if packed == "zstd" else content
        size = len(content) if says is None else says
        head = struct.pack("<QQQI", 0, 1, size, 0) + struct.pack("<I", len(packed)) + packed.encode()
        data += b"\x06" + struct.pack("<Q", len(head) + 8 + len(body)) + head
        data += struct.pack("<Q", len(body)) + body
    path.write_bytes(data)


@pytest.mark.parametrize("says", [None, 10])
def test_a_chunk_that_unpacks_to_more_than_ours_do_is_refused(tmp_path, says):
    chunked(tmp_path / "bomb.mcap", [bytes(17 << 20)], says=says)
    with pytest.raises(BslamError, match=r"bomb\.mcap: a chunk unpacks to more than 16 MB; allowed: a"):
        load(tmp_path / "bomb.mcap")


def test_chunks_that_together_unpack_to_more_than_there_is_room_for_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("bslam.recording.reader.BYTES_MAX", 4 << 20)
    unknown = b"\x99" + struct.pack("<Q", 1 << 20) + bytes(1 << 20)
    chunked(tmp_path / "bomb.mcap", [unknown] * 5)
    with pytest.raises(BslamError, match=r"bomb\.mcap: it unpacks to more than 4 MB; allowed: at most that"):
        load(tmp_path / "bomb.mcap")
    chunked(tmp_path / "other.mcap", [unknown], packed="lz4")
    with pytest.raises(BslamError, match=r"other\.mcap: a chunk packed by 'lz4'; allowed"):
        load(tmp_path / "other.mcap")


@pytest.mark.parametrize("content", [b"", b"no recording", b"\x89MCAP0\r\n"])
def test_what_is_no_recording_is_refused(content, tmp_path):
    path = tmp_path / "bad.mcap"
    path.write_bytes(content)
    with pytest.raises(BslamError, match=r"bad\.mcap.*allowed: a recording"):
        load(path)


def test_a_flipped_byte_is_refused(recorded, tmp_path):
    data = bytearray(recorded.path.read_bytes())
    data[len(data) // 2] ^= 1
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    with pytest.raises(BslamError, match="flipped"):
        load(path)


def test_odometry_of_two_kinds_is_no_log(recorded):
    other = Reading("velocity", 10**9, 0.1, 0.0)
    both = Recording(recorded.path, recorded.start, (*recorded.entries, other), True)
    with pytest.raises(BslamError, match="allowed: one kind"):
        as_log(both)
