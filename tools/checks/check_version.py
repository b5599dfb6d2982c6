"""Checks that bslam.h, pyproject.toml, CHANGELOG.md and the manifests of packages speak of the same version.

Exit status 0: they do. 1: they do not; says what each holds, "?" for none.
"""

import argparse
import json
import re
import sys
import tomllib
from pathlib import Path


def header_version(text: str) -> str:
    """ "1.2.3" from the macros BSLAM_VERSION_MAJOR, _MINOR and _PATCH."""
    parts = [re.search(rf"#define BSLAM_VERSION_{name} (\d+)", text) for name in ("MAJOR", "MINOR", "PATCH")]
    return ".".join(part[1] if part else "?" for part in parts)


def project_version(text: str) -> str:
    """What pip reads from pyproject.toml."""
    return str(tomllib.loads(text).get("project", {}).get("version", "?"))


def changelog_version(text: str) -> str:
    """The newest entry, "## 1.2.3 ..."."""
    match = re.search(r"^## (\d+\.\d+\.\d+)", text, re.MULTILINE)
    return match[1] if match else "?"


def json_version(text: str) -> str:
    """What PlatformIO reads from library.json."""
    return str(json.loads(text).get("version", "?"))


def line_version(text: str) -> str:
    """What a line of its own says: version=1.2.3, or version: "1.2.3"."""
    match = re.search(r'^version(?:=|: )"?([^"\s]+)"?\s*$', text, re.MULTILINE)
    return match[1] if match else "?"


READERS = {
    "firmware/bslam/bslam.h": header_version,
    "pyproject.toml": project_version,
    "CHANGELOG.md": changelog_version,
    "library.json": json_version,
    "idf_component.yml": line_version,
    "tools/packaging/arduino/library.properties": line_version,
}


def version(file: Path, name: str) -> str:
    """What the file of the repository called `name` says."""
    if not file.is_file():
        return "?"
    try:
        return READERS[name](file.read_text(encoding="utf-8"))
    except ValueError as error:  # no TOML, no JSON
        return f"? ({error})"


def versions(root: Path) -> dict[str, str]:
    """What each file says."""
    return {name: version(root / name, name) for name in READERS}


def complaint(found: dict[str, str]) -> str:
    """Which files differ from the header."""
    header, expected = next(iter(found.items()))
    differing = [f"{name} has {number}" for name, number in found.items() if number != expected]
    return f"versions differ: {header} has {expected}, but {', '.join(differing)}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="the repository (default: here)")
    found = versions(parser.parse_args(argv).root)
    if len(set(found.values())) == 1:
        return 0
    print(complaint(found), file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
