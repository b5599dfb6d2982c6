"""The front end says of the frames in tests/vectors what it said before, to the bit."""

from reference.make_frames import FRAMES, SAID, said

SIZE_MAX_BYTES = 300_000


def test_front_end_says_the_same_of_the_golden_frames() -> None:
    assert list(said()) == SAID.read_text(encoding="utf-8").splitlines()


def test_golden_frames_show_what_can_be_measured_and_what_cannot() -> None:
    lines = [line.split() for line in SAID.read_text(encoding="utf-8").splitlines() if line.startswith("  ")]
    measured = [line for line in lines if line[10] != "-"]
    rough = [line for line in lines if "cut_left" in line[1] or "cut_right" in line[1]]
    assert len({line[0] for line in lines}) >= 4  # kinds
    assert len(measured) >= 3
    assert any(line[8] != "-" and line[10] == "-" for line in rough)


def test_golden_frames_are_small() -> None:
    assert FRAMES.stat().st_size + SAID.stat().st_size < SIZE_MAX_BYTES
