"""tools/checks/check_version.py wants one version number in all places that state it."""

from pathlib import Path

import pytest

from tools.checks import check_version

HEADER = "#define BSLAM_VERSION_MAJOR 1\n#define BSLAM_VERSION_MINOR 2\n#define BSLAM_VERSION_PATCH 3\n"

ARDUINO = "tools/packaging/arduino/library.properties"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    (tmp_path / "firmware/bslam").mkdir(parents=True)
    (tmp_path / "firmware/bslam/bslam.h").write_text(HEADER, encoding="utf-8")
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n', encoding="utf-8")
    (tmp_path / "CHANGELOG.md").write_text(
        "# Changelog\n\n## 1.2.3 (unreleased)\n\n## 1.2.2\n", encoding="utf-8"
    )
    (tmp_path / "library.json").write_text('{"name": "bslam", "version": "1.2.3"}', encoding="utf-8")
    (tmp_path / "idf_component.yml").write_text('version: "1.2.3"\nlicense: MIT\n', encoding="utf-8")
    (tmp_path / "tools/packaging/arduino").mkdir(parents=True)
    (tmp_path / ARDUINO).write_text("name=bslam\nversion=1.2.3\n", encoding="utf-8")
    return tmp_path


def test_main_same_version_everywhere_passes(tree: Path) -> None:
    assert check_version.main(["--root", str(tree)]) == 0


@pytest.mark.parametrize(
    ("file", "text", "complaint"),
    [
        ("firmware/bslam/bslam.h", HEADER.replace("PATCH 3", "PATCH 4"), "bslam.h has 1.2.4"),
        ("firmware/bslam/bslam.h", "", "bslam.h has ?.?.?"),
        ("pyproject.toml", '[project]\nversion = "2.0.0"\n', "pyproject.toml has 2.0.0"),
        ("CHANGELOG.md", "# Changelog\n", "CHANGELOG.md has ?"),
        ("library.json", '{"version": "1.2.4"}', "1.2.3, but library.json has 1.2.4\n"),
        ("library.json", "{", "library.json has ? (Expecting"),
        ("idf_component.yml", 'version: "1.2.4"\n', "idf_component.yml has 1.2.4"),
        ("idf_component.yml", "license: MIT\n", "idf_component.yml has ?"),
        (ARDUINO, "version=1.3\n", "library.properties has 1.3"),
    ],
)
def test_main_differing_version_is_reported(
    tree: Path, capsys: pytest.CaptureFixture[str], file: str, text: str, complaint: str
) -> None:
    (tree / file).write_text(text, encoding="utf-8")
    assert check_version.main(["--root", str(tree)]) == 1
    assert complaint in capsys.readouterr().err
