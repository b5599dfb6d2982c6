"""The public CI: pinned, of make targets that exist, said not to have run. `make lint-ci` reads it whole."""

import re
from pathlib import Path

REPOSITORY = Path(__file__).parents[3]
TEXT = (REPOSITORY / ".github/workflows/ci.yml").read_text(encoding="utf-8")


def test_every_action_and_package_is_of_one_version():
    actions = re.findall(r"uses: (\S+)", TEXT)
    assert actions
    assert all(re.fullmatch(r"[\w/-]+@v\d+\.\d+\.\d+", action) for action in actions)
    assert all(re.fullmatch(r"\w+==[\d.]+", package) for package in re.findall(r"pip install (\S+)", TEXT))


def test_targets_of_make_exist():
    rules = "".join(path.read_text() for path in [REPOSITORY / "Makefile", *REPOSITORY.glob("mk/*.mk")])
    targets = re.findall(r"run: make (\S+)", TEXT)
    assert targets == ["test", "site"]
    assert all(re.search(rf"^{target}:", rules, re.MULTILINE) for target in targets)


def test_three_systems_have_wheels_and_it_says_that_it_has_not_run():
    assert all(name in TEXT for name in ("ubuntu-", "macos-", "windows-"))
    assert "It has not run yet" in TEXT.split("name:")[0]
