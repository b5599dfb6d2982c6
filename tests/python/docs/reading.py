"""What the tests of documents share: reading Markdown, and compiling C that stands in it."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
FIRMWARE = ROOT / "firmware"
STRICT = ["-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", f"-I{FIRMWARE}"]
ESTIMATOR = [str(path) for part in ("base", "bslam") for path in sorted((FIRMWARE / part).rglob("*.c"))]


def read(name: str) -> str:
    """A file of the repository."""
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    """The fenced blocks in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def block(text: str, language: str) -> str:
    """The only one."""
    (found,) = blocks(text, language)
    return found


def section(text: str, title: str) -> str:
    """The text below a heading, up to the next one of its level or above."""
    level = re.search(rf"^(#+) {re.escape(title)}$", text, re.MULTILINE)
    assert level is not None, title
    return re.split(rf"^#{{1,{len(level[1])}}} ", text[level.end() :], maxsplit=1, flags=re.MULTILINE)[0]


def column(text: str, number: int = 0) -> set[str]:
    """Every `word` in a column of the tables in a text."""
    rows = [row.split("|")[1:-1] for row in re.findall(r"^\|.*\|$", text, re.MULTILINE)]
    return {word for row in rows if len(row) > number for word in re.findall(r"`([^`]+)`", row[number])}


def output_of(source: str, folder: Path) -> str:
    """What a C program prints, compiled with the estimator and without a warning."""
    (folder / "example.c").write_text(source, encoding="utf-8")
    command = [os.environ.get("CC", "cc"), *STRICT, "example.c", *ESTIMATOR, "-lm", "-o", "example"]
    subprocess.run(command, cwd=folder, check=True)
    return subprocess.run(["./example"], cwd=folder, check=True, capture_output=True, text=True).stdout
