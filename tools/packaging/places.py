"""Where packages come from, files that git tracks, and how they get into a folder: all or none."""

import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class PackagingError(Exception):
    """What cannot be packed, and why."""


def tracked(root: Path, *folders: str) -> list[str]:
    """Files below these folders that git tracks, relative to the repository."""
    command = ["git", "-C", str(root), "ls-files", "-z", "--", *folders]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        raise PackagingError(f"{root} is no git repository; clone it with git: {done.stderr.strip()}")
    names = done.stdout.split("\0")[:-1]
    missing = [name for name in names if not (root / name).is_file()]
    if missing:
        raise PackagingError(f"git tracks {missing[0]}, which is not there")
    return names


def write_files(folder: Path, files: dict[str, bytes]) -> None:
    """Puts files into a folder once all of them are written; others in it stay."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in files:
        if (folder / name).is_dir():
            raise PackagingError(f"{folder / name} is a folder")
    with tempfile.TemporaryDirectory(dir=folder, prefix=".") as unfinished:
        for name, content in files.items():
            Path(unfinished, name).write_bytes(content)
        for name in files:
            Path(unfinished, name).replace(folder / name)
