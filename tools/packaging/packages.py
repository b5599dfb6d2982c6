"""Writes the C library's packages: archives for Arduino, PlatformIO and ESP-IDF, and the amalgamation.

Of files that git tracks; the same files give the same bytes.

Exit status 0: written. 2: something is missing, or versions differ; what was there stays as it is.
"""

import argparse
import gzip
import io
import sys
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

from tools.checks import check_version
from tools.packaging.amalgamate import amalgamated
from tools.packaging.places import ROOT, PackagingError, tracked, write_files

Files = dict[str, bytes]
LIBRARIES = ("base", "bslam", "vision", "link")
FOLDERS = tuple(f"firmware/{library}" for library in LIBRARIES)
ARDUINO = "tools/packaging/arduino"
SKETCHES = "examples/arduino"
MOMENT = (1980, 1, 1, 0, 0, 0)  # of every file: the first that a zip can name


def read(root: Path, *places: str) -> Files:
    """The files at or below these places."""
    found = {name: (root / name).read_bytes() for name in tracked(root, *places)}
    for place in places:
        if not any(name == place or name.startswith(f"{place}/") for name in found):
            raise PackagingError(f"git tracks nothing at {place}")
    return found


def below(files: Files, folder: str, to: str) -> Files:
    """The files of a folder, moved to another."""
    return {name.replace(folder, to, 1): text for name, text in files.items() if name.startswith(folder)}


def with_flat_names(files: Files) -> Files:
    """With the folder's name in front of a source's that another source has: where all objects go into one
    place, one of the two would be lost.
    """
    taken: set[str] = set()
    named: Files = {}
    for name, text in files.items():
        path = PurePosixPath(name)
        if path.suffix == ".c":
            if path.name in taken:
                path = path.with_name(f"{path.parent.name}_{path.name}")
            if path.name in taken:
                raise PackagingError(f"two sources are called {path.name}")
            taken.add(path.name)
        named[str(path)] = text
    return named


def arduino(root: Path) -> Files:
    """A library in Arduino's layout: sources below src, and there the headers that it looks for."""
    files = below(read(root, ARDUINO), f"{ARDUINO}/", "") | read(root, "LICENSE")
    files |= with_flat_names(below(read(root, *FOLDERS), "firmware", "src"))
    files |= below(read(root, f"{SKETCHES}/bslam_robot"), SKETCHES, "examples")
    return {f"bslam/{name}": text for name, text in files.items()}


def platformio(root: Path) -> Files:
    return read(root, "library.json", "LICENSE", "README.md", f"{ARDUINO}/src", *FOLDERS)


def esp_idf(root: Path) -> Files:
    own = ("CMakeLists.txt", "Kconfig", "idf_component.yml", "firmware/Kconfig", "firmware/cmake")
    return read(root, *own, "LICENSE", "README.md", "examples/esp_idf", *FOLDERS)


def zip_of(files: Files) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, MOMENT)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name], zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def tar_of(files: Files) -> bytes:
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for name in sorted(files):
            entry = tarfile.TarInfo(name)
            entry.size = len(files[name])
            archive.addfile(entry, io.BytesIO(files[name]))
    return gzip.compress(packed.getvalue(), mtime=0)


PACKAGES: dict[str, tuple[Callable[[Path], Files], Callable[[Files], bytes]]] = {
    "bslam-arduino-{}.zip": (arduino, zip_of),
    "bslam-platformio-{}.tar.gz": (platformio, tar_of),
    "bslam-esp-idf-{}.tar.gz": (esp_idf, tar_of),
    "bslam-amalgamation-{}.zip": (amalgamated, zip_of),
}


def packages(root: Path) -> Files:
    """Every package by its name."""
    versions = check_version.versions(root)
    if len(set(versions.values())) != 1:
        raise PackagingError(check_version.complaint(versions))
    version = next(iter(versions.values()))
    return {name.format(version): pack(files(root)) for name, (files, pack) in PACKAGES.items()}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--root", type=Path, default=ROOT, help="the repository")
    parser.add_argument("--out", type=Path, default=Path("out/packages"), help="the folder")
    options = parser.parse_args(argv)
    try:
        made = packages(options.root)
        write_files(options.out, made)
    except (PackagingError, OSError) as error:
        print(f"packages: {error}", file=sys.stderr)
        return 2
    for name, packed in made.items():
        print(f"{options.out / name}: {len(packed) // 1000} KB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
