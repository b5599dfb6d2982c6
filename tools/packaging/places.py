"""Where packages come from, files that git tracks, and go to: a folder that is there whole or not at all."""

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
        raise PackagingError(f"{root} is no git repository: {done.stderr.strip()}")
    names = done.stdout.split("\0")[:-1]
    missing = [name for name in names if not (root / name).is_file()]
    if missing:
        raise PackagingError(f"git tracks {missing[0]}, which is not there")
    return names


def replace_folder(folder: Path, files: dict[str, bytes]) -> None:
    """Puts a folder of exactly these files in the place of what is there, at once."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as beside:
        new, old = Path(beside, "new"), Path(beside, "old")
        for name, content in files.items():
            (new / name).parent.mkdir(parents=True, exist_ok=True)
            (new / name).write_bytes(content)
        if folder.exists():
            folder.rename(old)
        new.rename(folder)
