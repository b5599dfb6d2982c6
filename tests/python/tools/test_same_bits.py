"""What is said of boards whose states are compared with this computer's."""

from collections.abc import Sequence

import pytest

from bslam.errors import BslamError
from bslam.log import Log
from bslam.options import RunOptions
from bslam.target.lines import TargetError
from tools.proofs import same_bits

STATES: dict[str, list[int] | Exception] = {
    "host": [1, 2, 3],
    "qemu:like": [1, 2, 3],
    "qemu:unlike": [1, 2, 4],
    "qemu:small": BslamError("no room"),
    "qemu:plain": TargetError("parameter filter = 2: the image is built with BSLAM_SMOOTHER=0"),
    "qemu:gone": TargetError("ended with status 1"),
}


@pytest.fixture(autouse=True)
def boards(monkeypatch: pytest.MonkeyPatch) -> None:
    """The processes of main() have it, too: they are forked."""

    def states(_: Log, options: RunOptions) -> Sequence[int]:
        found = STATES[options.target]
        if isinstance(found, Exception):
            raise found
        return found

    monkeypatch.setattr(same_bits, "fingerprints", states)


@pytest.mark.parametrize(
    ("names", "status", "last"),
    [
        (["like", "small", "plain"], 0, "boards: 1 the same, 0 different, 2 left out, over 3 states"),
        (["like", "unlike"], 1, "boards: 1 the same, 1 different, 0 left out, over 3 states"),
        (["small"], 1, "boards: 0 the same, 0 different, 1 left out, over 3 states"),
    ],
)
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_boards_are_counted_and_one_that_differs_or_none_at_all_fails(
    names: list[str], status: int, last: str, jobs: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert same_bits.main(["--steps", "3", "--jobs", jobs, "--boards", *names]) == status
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == last
    assert [line.split()[0] for line in said[2:-1]] == names


def test_a_board_that_goes_away_is_no_board_left_out() -> None:
    with pytest.raises(TargetError):
        same_bits.main(["--steps", "3", "--boards", "gone"])
