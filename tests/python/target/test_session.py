"""A session with the application, as a process of this computer: over a good line, and over a bad one."""

import random
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bslam.cli import main
from bslam.core.errors import CoreError
from bslam.core.slam import Slam
from bslam.errors import BslamError
from bslam.link import messages
from bslam.link.frames import Frame, encode
from bslam.link.messages import Message
from bslam.log import first_steps
from bslam.options import RunOptions
from bslam.recording import load
from bslam.runs.runner import run_log
from bslam.target import client
from bslam.target.client import Client
from bslam.target.film import write_film
from bslam.target.lines import ProcessLine, TargetError, open_line
from bslam.target.remote import RemoteSlam
from bslam.world.simulate import load_scenario, simulate
from target.loaded import as_loaded

ROBOT = Path(__file__).parents[3] / "build" / "host" / "robot"
STEPS = 250


@pytest.fixture
def robot_line():
    """Makes lines to processes that run the application, and ends them all."""
    lines = []

    def make():
        lines.append(ProcessLine(ROBOT))
        return lines[-1]

    yield make
    for line in lines:
        line.close()


@pytest.fixture(scope="module")
def log():
    return first_steps(simulate(load_scenario("paper_room"), 3), STEPS)


def drive(slam, log, first, last):
    """Feeds a part of a drive; whether it was lost after each step, and the poses."""
    odometry, seen = log.odometry, log.sightings
    lost, poses = [], []
    for row in range(first, last):
        time_us = int(odometry.time_us[row])
        slam.odometry("wheels", time_us, float(odometry.a[row]), float(odometry.b[row]))
        rows = np.flatnonzero(seen.time_us == time_us)
        columns = (seen.bearing_rad[rows].tolist(), seen.range_m[rows].tolist())
        slam.sightings(time_us, *columns, seen.beacon_id[rows].tolist(), seen.mappable[rows].tolist())
        lost.append(slam.is_lost)
        poses.append(slam.pose())
    return lost, poses


def test_a_robot_that_recovers_is_the_host_s_and_says_how_it_is(robot_line):
    """It drives, is told that it stands elsewhere, is lost, and finds itself again."""
    log = first_steps(simulate(load_scenario("paper_room"), 3), 200)
    params = {"recovery": 1, "left_speed_sd_mps": 0.3, "right_speed_sd_mps": 0.3}
    here = Slam(params, beacons_max=6)
    with RemoteSlam(robot_line(), params, 6) as there:
        healthy = there.health()
        assert (healthy.recovers, healthy.guards, healthy.state) == (True, False, "following")
        assert healthy.trouble == "none"
        assert drive(here, log, 0, 40) == drive(there, log, 0, 40)
        here.set_pose(5.0, 3.0, 2.0, 0.02, 0.02)
        there.set_pose(5.0, 3.0, 2.0, 0.02, 0.02)
        mine, theirs = drive(here, log, 40, 200), drive(there, log, 40, 200)
        assert mine == theirs
        assert True in mine[0] and not mine[0][-1]
        health = there.health()
        assert (health.state, health.trouble, health.lost, health.found) == ("following", "found", 1, 1)
        assert there.counters() == here.counters()


def test_a_map_goes_to_the_host_and_to_another_robot_which_finds_itself_in_it(robot_line, log):
    params = {"association": 0}
    with RemoteSlam(robot_line(), params, 20) as robot:
        host = Slam(params, beacons_max=20)
        for slam in (robot, host):
            drive(slam, log, 0, 150)
        blob = robot.save_map()
        assert blob == host.save_map()
    with RemoteSlam(robot_line(), params | {"recovery": 1}, 20) as other:
        before = other.save_map()
        for bad in (blob[:-1], blob[:40] + bytes([blob[40] ^ 4]) + blob[41:]):
            with pytest.raises(CoreError, match=r"truncated|bad crc"):
                other.load_map(bad)
            assert other.save_map() == before
            assert not other.is_lost
        other.load_map(blob)
        assert other.is_lost
        assert other.save_map() == as_loaded(blob)
        drive(other, log, 0, 100)
        assert not other.is_lost
        with pytest.raises(TargetError, match="STORE"):
            other.load_map(bytes(70_000))


def test_a_score_that_is_sent_puts_a_beacon_on_trial_as_on_the_host(robot_line):
    told = []
    with RemoteSlam(robot_line(), {"association": 3}, 20) as robot:
        for slam in (robot, Slam(robot.host_params, beacons_max=20)):
            told.append([])
            for step in range(8):
                slam.odometry("wheels", 40_000 * (step + 1), 0.001, 0.001)
                seen = slam.sightings(40_000 * (step + 1), [0.1], [4.0], [-1], [True], score=[2.0])
                told[-1] += [(seen[0].result, seen[0].reason)]
    assert told[0] == told[1]
    assert told[0] == [("new", "none"), *[("deferred", "tentative")] * 4, *[("matched", "none")] * 3]


def test_a_map_that_changes_while_it_is_read_is_read_again(robot_line, log, monkeypatch):
    with RemoteSlam(robot_line(), {"association": 0}, 20) as robot:
        drive(robot, log, 0, 100)
        whole, cut = robot.save_map(), iter([True, False, True, True, True])
        read = RemoteSlam._read_map
        monkeypatch.setattr(RemoteSlam, "_read_map", lambda self: read(self)[: -4 if next(cut) else None])
        assert robot.save_map() == whole
        with pytest.raises(TargetError, match="changed while it was read"):
            robot.save_map()


def flip_a_bit(line):
    """In the parameters of the filter, in the memory of the running robot."""
    process = line._process.pid
    names = subprocess.run(["nm", ROBOT], capture_output=True, text=True, check=True).stdout
    offset = next(int(row.split()[0], 16) for row in names.splitlines() if row.endswith(" b robot"))
    areas = Path(f"/proc/{process}/maps").read_text().splitlines()
    first = next(row for row in areas if row.endswith(str(ROBOT))).split("-")[0]
    with Path(f"/proc/{process}/mem").open("r+b", buffering=0) as memory:
        memory.seek(int(first, 16) + offset + 16)
        byte = memory.read(1)[0]
        memory.seek(-1, 1)
        memory.write(bytes((byte ^ 4,)))


@pytest.mark.parametrize("guard", [True, False])
def test_a_bit_that_flips_in_a_robot_s_memory_is_noticed_where_it_is_guarded(robot_line, guard):
    line = robot_line()
    with RemoteSlam(line, {"association": 0, "guard": int(guard)}, 6) as robot:
        robot.sightings(0, [0.1], [2.0], [7], [True])
        robot.odometry("wheels", 40_000, 0.01, 0.01)
        flip_a_bit(line)
        if guard:
            with pytest.raises(CoreError, match="BSLAM_E_STATE"):
                robot.odometry("wheels", 80_000, 0.01, 0.01)
            assert robot.beacons() == []
            health = robot.health()
            assert (health.trouble, health.trouble_us, health.corrupt) == ("corrupt", 80_000, 1)
        robot.odometry("wheels", 120_000, 0.01, 0.01)
        assert robot.health().corrupt == int(guard)


def test_a_robot_starts_in_the_map_that_it_kept_and_falls_back_to_it(robot_line, log, tmp_path, monkeypatch):
    monkeypatch.setenv("BSLAM_MAP", str(tmp_path / "flash"))
    with RemoteSlam(robot_line(), {"association": 0, "recovery": 1}, 6) as robot:
        drive(robot, log, 0, 100)
        robot.keep_map()
        blob = robot.save_map()
    with RemoteSlam(robot_line(), None, 6) as robot:
        assert robot.is_lost and robot.save_map() == as_loaded(blob)
        health = robot.health()
        assert (health.recovers, health.guards, health.trouble) == (True, True, "none")
    line = robot_line()
    with RemoteSlam(line, {"association": 0, "recovery": 1, "guard": 1}, 6) as robot:
        drive(robot, log, 0, 40)
        flip_a_bit(line)
        with pytest.raises(CoreError, match="BSLAM_E_STATE"):
            robot.odometry("wheels", 2_000_000, 0.0, 0.0)
        assert robot.is_lost and robot.save_map() == as_loaded(blob)
        assert robot.health().trouble == "corrupt"


def test_a_robot_that_keeps_no_map_says_so(robot_line):
    with RemoteSlam(robot_line(), {}, 6) as robot, pytest.raises(TargetError, match="STORE"):
        robot.keep_map()


def same(one, other):
    """Two traces agree to the bit in everything but where and how fast."""
    assert (one.pose == other.pose).all()
    assert (one.covariance == other.covariance).all()
    assert one.counts == other.counts
    assert one.counters == other.counters
    assert one.parameters == other.parameters
    assert [b.x_m for b in one.beacons] == [b.x_m for b in other.beacons]
    assert [b.covariance_m2.tolist() for b in one.beacons] == [
        b.covariance_m2.tolist() for b in other.beacons
    ]


@pytest.fixture
def moving(monkeypatch, tmp_path):
    """Robots drive by themselves."""
    write_film(tmp_path / "wheels", 10_000, np.array([[3, 4]]))
    monkeypatch.setenv("BSLAM_FILM", str(tmp_path / "wheels"))


class BadLine:
    """A line that flips, cuts, doubles and loses: each frame either way with this probability."""

    def __init__(self, seed, rate, line):
        self.random, self.rate, self.line = random.Random(seed), rate, line
        self.spoilt = 0
        self.ns_per_instruction, self.attempts = None, 40
        self.description = line.description

    def spoil(self, data):
        if self.random.random() >= self.rate:
            return data
        self.spoilt += 1
        kind = self.random.choice(["lose", "flip", "cut", "double", "noise"])
        at = self.random.randrange(len(data))
        if kind == "lose":
            return b""
        if kind == "flip":
            return data[:at] + bytes((data[at] ^ 1 << self.random.randrange(8),)) + data[at + 1 :]
        if kind == "cut":
            return data[:at] + b"\0"
        if kind == "double":
            return data + data
        return self.random.randbytes(20) + b"\0" + data

    def write(self, data):
        spoilt = self.spoil(data)
        if spoilt:
            self.line.write(spoilt)

    def read(self, timeout_s):
        data = self.line.read(timeout_s)
        return self.spoil(data) if data else data

    def close(self):
        self.line.close()


@pytest.mark.parametrize(
    "words",
    [{}, {"observation": "direction"}, {"known_map": True}, {"parameters": (("sighting_delay_us", 50_000),)}],
)
def test_a_run_over_the_link_is_the_run_on_the_host(log, words):
    here = run_log(log, RunOptions(**words))
    there = run_log(log, RunOptions(**words, target=f"process:{ROBOT}"))
    same(here, there)
    assert there.target["image"] == "host/robot"


def test_a_run_over_a_bad_line_is_still_the_run_on_the_host(log, monkeypatch, robot_line):
    monkeypatch.setattr(client, "ANSWER_TIMEOUT_S", 0.05)
    lines = []

    def factory(params, beacons):
        lines.append(BadLine(5, 0.1, robot_line()))
        return RemoteSlam(lines[0], params, beacons)

    there = run_log(log, RunOptions(), factory)
    assert lines[0].spoilt > 20
    same(run_log(log, RunOptions()), there)


def test_a_replayed_message_is_not_applied_again(robot_line):
    line = robot_line()
    sent = []
    write = line.write
    line.write = lambda data: (sent.append(data), write(data))
    robot = Client(line)
    robot.ask(Message.RESET)
    for step in range(1, 6):
        robot.ask(Message.ODOMETRY, messages.odometry("wheels", 0.02, 0.02, None), step * 40_000)
    before = messages.read_counters(robot.ask(Message.COUNTERS).body)
    for data in sent[:-1]:
        write(data)  # older than the last: dropped, the greeting too
    write(sent[-1])  # the last: answered again
    after = messages.read_counters(robot.ask(Message.COUNTERS).body)
    assert after[:-7] == before[:-7]  # what follows are counters of the link
    assert after[-2:] == [1, 7]  # repeated, replayed


@pytest.mark.parametrize(
    ("kind", "payload", "refusal"),
    [
        (0x33, b"", "TYPE"),
        (Message.ODOMETRY, b"\0\0", "LENGTH"),
        (Message.PARAM_SET, b"\0" * 7, "LENGTH"),
        (Message.SIGNATURES, b"\0\1" + b"\0" * 4, "LENGTH"),
        (Message.SEEDS, b"\0\2" + b"\0" * 4 * 71, "LENGTH"),
    ],
)
def test_a_message_that_is_none_is_refused(kind, payload, refusal, robot_line):
    line = robot_line()
    robot = Client(line)
    with pytest.raises(TargetError, match=refusal):
        robot.ask(Message(kind) if kind in list(Message) else _Odd(kind), payload)


class _Odd(int):
    name = "odd"


def test_a_message_before_a_session_is_refused(robot_line):
    line = robot_line()
    line.write(encode(Frame(Message.MAP, 7, 0, b"\0")))
    from bslam.link.frames import Decoder

    decoder, found = Decoder(), []
    while not any(frame.type == Message.MAP | messages.ANSWER for frame in found):
        found += decoder.push(line.read(5.0))
    assert found[-1].payload[0] == 0x40  # NO_SESSION


def test_a_robot_that_starts_anew_ends_the_run(robot_line):
    first, second = robot_line(), robot_line()
    robot = RemoteSlam(first, {}, 6)
    robot.odometry("wheels", 40_000, 0.01, 0.01)
    first.close()
    first._process, first._program = second._process, second._program
    with pytest.raises(TargetError, match="started anew"):
        robot.odometry("wheels", 80_000, 0.01, 0.01)


def test_a_robot_that_goes_away_ends_the_run(robot_line):
    line = robot_line()
    robot = RemoteSlam(line, {}, 6)
    line._process.kill()
    with pytest.raises(TargetError, match="ended with status"):
        robot.odometry("wheels", 40_000, 0.01, 0.01)


def test_refusals_are_those_of_the_host(robot_line):
    line = robot_line()
    here, there = Slam({"filter": 0}), RemoteSlam(line, {"filter": 0}, 20)
    calls = [
        ("odometry", ("wheels", 40_000, 0.02, 0.02)),
        ("odometry", ("wheels", 40_000, 0.02, 0.02)),
        ("odometry", ("wheels", 80_000, float("nan"), 0.02)),
        ("odometry", ("velocity", 80_000, 1e30, 1e30)),
        ("odometry", ("ticks", 80_000, 1 << 20, 0)),
        ("sightings", (80_000, [0.1], [2.0], [3], [True])),
        ("sightings", (80_000, [0.1], [2.0], [3], [True])),
        ("sightings", (90_000, [0.1, 9.0], [2.0, 2.0], [3, 4], [True, True])),
        ("sightings", (95_000, [], [], [], [])),
        ("sightings", (96_000, [0.0] * 65, [1.0] * 65, list(range(65)), [True] * 65)),
        ("add_known_beacon", (3, 1.0, 1.0)),
        ("add_known_beacon", (-5, 1.0, 1.0)),
        ("remove_beacon", (77,)),
        ("pose_at", (20_000,)),
        ("pose_at", (10**9,)),
        ("resume_odometry", (99.0, 0.0)),
        ("resume_odometry", (0.1, 0.1)),
        ("set_pose", (1.0, 2.0, 0.5, 0.1, 0.05)),
        ("set_pose", (1.0, 2.0, 0.5, 99.0, 0.05)),
    ]
    for name, arguments in calls:
        answers = []
        for slam in (here, there):
            try:
                answers.append(getattr(slam, name)(*arguments))
            except CoreError as error:
                answers.append(error.status)
        assert answers[0] == answers[1], (name, arguments)
        assert here.pose() == there.pose()
        assert here.pose_covariance_lower() == there.pose_covariance_lower()
    assert here.beacons()[0].uid == there.beacons()[0].uid


def test_an_image_that_is_too_small_is_refused(robot_line):
    line = robot_line()
    with pytest.raises(BslamError, match="room for 50 beacons"):
        RemoteSlam(line, {}, 50)


@pytest.mark.parametrize(
    ("target", "says"),
    [
        ("qemu:nowhere", "allowed: host, qemu:"),
        ("fax:1", "allowed: host, qemu:"),
        ("process:/nowhere", "is missing"),
        ("serial:/dev/nowhere", "allowed: a device"),
    ],
)
def test_a_target_that_cannot_be_is_refused(target, says):
    with pytest.raises(BslamError, match=says):
        open_line(target)


def test_without_qemu_it_fails_with_what_to_install(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(BslamError, match="apt-get install qemu-system-arm"):
        open_line("qemu:mps2_an386")


def test_any_message_is_answered_or_dropped_and_never_a_crash(robot_line):
    """Whole frames of arbitrary messages, under the sanitizers: most payloads as long as their message's."""
    random_ = random.Random(11)
    lengths = {0x01: 5, 0x02: 0, 0x03: 14, 0x05: 8, 0x06: 12, 0x07: 4, 0x08: 6, 0x09: 2, 0x0B: 1}
    line = robot_line()
    first = Client(line)._sequence + 1
    for step in range(1500):
        kind = random_.choice([*Message, *Message, 0x3F])
        length = lengths.get(kind, random_.choice([0, 1, 23, 45, 286, 300]))
        payload = bytearray(random_.randbytes(length))
        if kind == Message.SIGHTINGS and length > 1:
            payload[0] = length // 22
        if kind in (Message.SIGNATURES, Message.SEEDS) and length == 286:
            payload[:2] = random_.choice([b"\0\1", b"\x0f\1", b"\x7f\1", b"\xff\1", b"\xff\xff"])
        time_us = random_.choice([step * 40_000, random_.randrange(-(2**63), 2**63)])
        line.write(encode(Frame(kind, (first + step) % 65536, time_us, bytes(payload))))
        if step % 50 == 0:
            while line.read(0.001):
                pass
    robot = RemoteSlam(line, {}, 6)
    robot.odometry("wheels", 40_000, 0.01, 0.01)
    assert robot.counters()["odometry"] == 1


def test_parameters_that_are_saved_are_there_after_a_restart(robot_line, tmp_path, monkeypatch):
    monkeypatch.setenv("BSLAM_STORE", str(tmp_path / "stored"))
    robot = RemoteSlam(robot_line(), None, 6)
    assert robot.params == Slam.defaults() | {
        name: value for name, value in robot.params.items() if isinstance(value, float)
    }
    robot.set_param("wheelbase_m", 0.31)
    robot.set_param("ticks_per_revolution", 4096)
    robot.save_params()
    again = RemoteSlam(robot_line(), None, 6)
    assert again.params == robot.params
    assert again.params["wheelbase_m"] == pytest.approx(0.31)
    stored = bytearray((tmp_path / "stored").read_bytes())
    stored[40] ^= 1
    (tmp_path / "stored").write_bytes(stored)
    assert RemoteSlam(robot_line(), None, 6).params["ticks_per_revolution"] == 1024


def test_a_board_that_keeps_nothing_says_so(robot_line, monkeypatch):
    monkeypatch.delenv("BSLAM_STORE", raising=False)
    with pytest.raises(TargetError, match="STORE: the board keeps nothing"):
        RemoteSlam(robot_line(), None, 6).save_params()


def test_a_console_changes_nothing_of_what_a_robot_knows(robot_line):
    line = robot_line()
    first = RemoteSlam(line, {"gate_d2": 9.0}, 6)
    first.odometry("wheels", 40_000, 0.02, 0.02)
    first.sightings(40_000, [0.3], [3.0], [5], [True])
    counters = first.counters()
    second = RemoteSlam(line, None, 6)
    assert second.pose() == first.pose()
    assert second.params == first.params
    assert [one.label for one in second.beacons()] == [5]
    assert second.counters() == counters
    second.reset()
    assert second.beacons() == []
    assert second.update().pose == (0.0, 0.0, 0.0)


def test_a_robot_s_own_readings_are_reported_and_lost_ones_are_counted(robot_line, moving):
    robot = RemoteSlam(robot_line(), None, 6)
    found = []
    while len(found) < 8:
        found += robot.reports(1.0)
    ticks = [told.report.left_ticks for told in found]
    assert ticks == [3 * n for n in range(ticks[0] // 3, ticks[0] // 3 + len(found))]
    assert all(told.refused is None for told in found)
    assert robot.reports_lost == 0
    robot._client._last_report -= 2  # as if two had not come
    robot.reports(1.0)
    assert robot.reports_lost == 2


@pytest.mark.usefixtures("robots_clock")
def test_a_console_s_recording_replays_to_the_same_bits(tmp_path, moving, capsys):
    path = tmp_path / "drive.mcap"
    words = ["console", f"process:{ROBOT}", "--seconds", "1.2", "--record", str(path), "--reset"]
    words += ["--set-pose", "1,2,0.5,0.1,0.05"]
    assert main([*words, "--set", "ticks_per_revolution=4096"]) == 0
    said = capsys.readouterr().out
    assert "counters  odometry" in said and "map       empty" in said and "heading" in said
    assert main(["replay", str(path), "--pictures", "0", "--out", str(tmp_path / "out")]) == 0
    assert "states are the recorded ones to the bit" in capsys.readouterr().out


@pytest.mark.usefixtures("robots_clock")
def test_a_recording_of_a_robot_that_has_moved_says_what_it_lacks(robot_line, tmp_path, moving, monkeypatch):
    from bslam.commands import console

    line = robot_line()
    robot = RemoteSlam(line, None, 6)
    while robot.counters()["odometry"] < 20:
        robot.reports(0.2)
    monkeypatch.setattr(console, "open_line", lambda target: line)
    path = tmp_path / "late.mcap"
    assert main(["console", "process:it", "--seconds", "0.3", "--record", str(path)]) == 0
    assert load(path).entries[0].lost >= 20
    assert main(["replay", str(path), "--pictures", "0", "--out", str(tmp_path / "out")]) == 1


def test_a_console_drives_a_robot_by_a_scenario(tmp_path, capsys):
    path = tmp_path / "fed.mcap"
    words = ["console", f"process:{ROBOT}", "--drive", "paper_room", "--association", "known"]
    assert main([*words, "--seconds", "1.5", "--record", str(path)]) == 0
    assert "driven by paper_room" in capsys.readouterr().out
    assert main(["replay", str(path), "--pictures", "0", "--out", str(tmp_path / "out")]) == 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["fax:1"], "allowed: host, qemu:"),
        (["serial:/dev/nowhere"], "allowed: a device"),
        (["ROBOT", "--set", "nothing=1"], "KEY of `bslam params --all`"),
        (["ROBOT", "--set", "gate_d2=high"], "allowed: a number"),
        (["ROBOT", "--drive", "nowhere"], "nowhere"),
        (["ROBOT", "--target", "qemu:mps2_an386"], "first argument"),
    ],
)
def test_what_a_console_cannot_do_is_bad_input(words, says, capsys):
    words = [f"process:{ROBOT}" if word == "ROBOT" else word for word in words]
    try:
        status = main(["console", *words])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert says in capsys.readouterr().err.splitlines()[-1]
