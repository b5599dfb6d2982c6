"""Asks the tools of PlatformIO, ESP-IDF, Zephyr and Arduino whether they take the C library's packages.

`make check-packages` runs it in an environment with those tools. No board's compiler is needed: PlatformIO
builds for this computer, by a platform that is written here, with SCons of the Python index.

Exit status 0: all that are here take it. 1: one does not, see above.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TOOLS = Path(sys.executable).parent
# `pio pkg pack` asks the web for the known licences: here those that Python's `packaging` knows.
PIO = """import sys
from packaging.licenses._spdx import LICENSES
from platformio.__main__ import main
from platformio.package.manifest.schema import ManifestSchema
known = {"licenses": [{"licenseId": each["id"]} for each in LICENSES.values()]}
ManifestSchema.load_spdx_licenses = staticmethod(lambda: known)
sys.exit(main())
"""
PLATFORM = """from SCons.Script import Default, DefaultEnvironment
environment = DefaultEnvironment()
environment.Append(LIBS=["m"])
Default(environment.BuildProgram())
"""
WANTED = "from platformio.dependencies import *; print(get_core_dependencies()['tool-scons'].lstrip('~'))"
SCONS = "from SCons.Script import main\nmain()\n"


class RefusedError(Exception):
    """What a tool said."""


def run(*command: object, folder: Path, **words: str) -> str:
    done = subprocess.run(
        list(map(str, command)),
        cwd=folder,
        env=os.environ | words,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise RefusedError(f"{' '.join(map(str, command[:4]))}\n{done.stdout}{done.stderr}")
    return done.stdout


def unpacked(archive: Path, folder: Path) -> Path:
    folder.mkdir()
    shutil.unpack_archive(archive, folder)
    return folder


def files_in(archive: Path) -> set[str]:
    with tarfile.open(archive) as tape:
        return {member.name.removeprefix("./") for member in tape.getmembers() if member.isfile()}


def same_files(made: Path, ours: Path) -> None:
    """The tool's own archive has what ours has."""
    if files_in(made) != files_in(ours):
        raise RefusedError(f"{made.name} and {ours.name} differ in {sorted(files_in(made) ^ files_in(ours))}")


# ---- PlatformIO --------------------------------------------------------------------------------------------


def put_package(
    folder: Path, kind: str, name: str, number: str, manifest: str, files: dict[str, str]
) -> None:
    """A package where PlatformIO keeps those that it fetched."""
    spec = {"owner": "platformio", "id": None, "name": name, "requirements": None, "uri": None}
    described = {"name": name, "version": number, "title": name, "description": name, "packages": {}}
    texts = files | {
        manifest: json.dumps(described),
        ".piopm": json.dumps({"type": kind, "name": name, "version": number, "spec": spec}),
    }
    for place, text in texts.items():
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        (folder / place).write_text(text, encoding="utf-8")


def platformio(archive: Path, work: Path) -> str:
    core = work / "core"
    words = {"PLATFORMIO_CORE_DIR": str(core), "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no"}
    pio = (sys.executable, work / "pio.py")
    (work / "pio.py").write_text(PIO, encoding="utf-8")
    package = unpacked(archive, work / "package")
    run(*pio, "pkg", "pack", "-o", work / "packed.tar.gz", folder=package, **words)
    same_files(work / "packed.tar.gz", archive)

    wanted = run(sys.executable, "-c", WANTED, folder=work).strip()
    put_package(
        core / "packages/tool-scons", "tool", "tool-scons", wanted, "package.json", {"scons.py": SCONS}
    )
    put_package(core / "platforms/native", "platform", "native", "1.0.0", "platform.json",
                {"builder/main.py": PLATFORM})  # fmt: skip
    project = work / "project"
    (project / "src").mkdir(parents=True)
    (project / "platformio.ini").write_text(
        f"[env:here]\nplatform = native\nlib_deps = file://{archive}\nbuild_flags = -DBSLAM_BEACONS_MAX=7\n",
        encoding="utf-8",
    )
    sketch = (ROOT / "tests/sketches/estimator.cpp").read_text(encoding="utf-8")
    (project / "src/main.cpp").write_text(f"#include <bslam.h>\n{sketch}", encoding="utf-8")
    run(*pio, "run", folder=project, **words)
    built = project / ".pio/build/here"
    said = run(built / "program", folder=project)
    members = run("ar", "t", next(built.rglob("libbslam.a")), folder=project).split()
    sources = list(package.rglob("*.c"))
    if len(members) != len(sources):
        raise RefusedError(f"{len(members)} objects of {len(sources)} sources")
    return f"pkg pack; a project for this computer has its {len(members)} objects and says: {said.strip()}"


# ---- the others --------------------------------------------------------------------------------------------


# As a project's `dependencies: {bslam: {git: URL}}` is fetched.
FROM_GIT = """import sys
from idf_component_tools.manifest import SolvedComponent
from idf_component_tools.sources import GitSource
source = GitSource(git=sys.argv[1])
found = source.versions("bslam").versions[0]
hashed = found.component_hash
solved = SolvedComponent(name="bslam", version=found.version, source=source, component_hash=hashed)
source.download(solved, "managed/bslam")
"""
MENU = "import esp_kconfiglib as k; print(k.Kconfig('Kconfig').syms['BSLAM_BEACONS_MAX'].str_value)"


def esp_idf(archive: Path, work: Path) -> str:
    component = unpacked(archive, work / "bslam")
    run(TOOLS / "compote", "component", "pack", "--name", "bslam", folder=component)
    same_files(next(component.rglob("*.tgz")), archive)
    fetched = work / "managed/bslam"
    fetched.mkdir(parents=True)
    run(sys.executable, "-c", FROM_GIT, f"file://{ROOT}", folder=work)
    names = {path.relative_to(fetched).as_posix() for path in fetched.rglob("*") if path.is_file()}
    if names != files_in(archive):
        raise RefusedError(f"of git it fetches others: {sorted(names ^ files_in(archive))}")
    said = run(sys.executable, "-c", MENU, folder=fetched).strip()
    return f"compote component pack; fetched of git; its menu has BSLAM_BEACONS_MAX={said}"


MANIFEST = """manifest:
  projects:
    - name: bslam
      url: file://{root}
      revision: {revision}
      path: modules/bslam
  self:
    path: application
"""
# What Zephyr's scripts/zephyr_module.py takes, as far as this module goes.
MODULE = """type: map
mapping:
  name: {type: str}
  build: {type: map, mapping: {cmake: {type: str}, kconfig: {type: str}}}
"""


def zephyr(_archive: Path, work: Path) -> str:
    """By west, of what is committed: the module is the repository."""
    revision = run("git", "rev-parse", "HEAD", folder=ROOT).strip()
    (work / "application").mkdir()
    manifest = MANIFEST.format(root=ROOT, revision=revision)
    (work / "application/west.yml").write_text(manifest, encoding="utf-8")
    run(TOOLS / "west", "init", "-l", "application", folder=work)
    run(TOOLS / "west", "update", folder=work)
    listed = run(TOOLS / "west", "list", "--format", "{name} {path}", folder=work)
    module = work / "modules/bslam"
    (work / "schema.yml").write_text(MODULE, encoding="utf-8")
    run(TOOLS / "pykwalify", "-d", module / "zephyr/module.yml", "-s", work / "schema.yml", folder=work)
    if "bslam modules/bslam" not in listed or not (module / "zephyr/CMakeLists.txt").is_file():
        raise RefusedError(f"west list: {listed}")
    return "west update fetches the module; its module.yml is valid"


BOARDS = "pc.name=This computer\npc.build.core=core\npc.build.board=PC\n"
RECIPES = """name=here
version=1.0.0
recipe.c.o.pattern=gcc -c -std=gnu17 {includes} "{source_file}" -o "{object_file}"
recipe.cpp.o.pattern=g++ -c -std=gnu++17 {includes} "{source_file}" -o "{object_file}"
recipe.ar.pattern=ar rcs "{archive_file_path}" "{object_file}"
recipe.c.combine.pattern=g++ -o "{build.path}/program" {object_files} "{archive_file_path}" -lm
recipe.preproc.macros=g++ -w -x c++ -E -CC {includes} "{source_file}" -o "{preprocessed_file_path}"
tools.ctags.pattern=true "{source_file}"
"""
CORE = "void setup();\nvoid loop();\nint main()\n{\n    setup();\n    loop();\n    return 0;\n}\n"


def arduino(archive: Path, work: Path) -> str:
    """What is on PATH: the linter, which asks the web for names that are taken, and the build tool."""
    library = unpacked(archive, work / "libraries") / "bslam"
    said = []
    if lint := shutil.which("arduino-lint"):
        run(lint, "--library-manager", "false", "--compliance", "specification", library, folder=work)
        said.append("arduino-lint finds no error")
    if cli := shutil.which("arduino-cli"):
        said.append(f"arduino-cli builds {arduino_objects(cli, library, work)} objects of it with a sketch")
    return "; ".join(said) or "left out: neither arduino-lint nor arduino-cli is on PATH"


def arduino_objects(cli: str, library: Path, work: Path) -> int:
    """Of a sketch that includes the library, compiled for this computer."""
    system = work / "hardware/here/here"
    texts = {
        system / "boards.txt": BOARDS,
        system / "platform.txt": RECIPES,
        system / "cores/core/Arduino.h": "",
        system / "cores/core/main.cpp": CORE,
        work
        / "sketch/sketch.ino": "#include <bslam.h>\nstatic bslam_t robot;\nvoid setup() {}\nvoid loop() {}\n",
        work / "cli.yaml": f"directories: {{data: {work}/data, user: {work}}}\n",
        work / "data/library_index.json": '{"libraries": []}',
    }
    for path, text in texts.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    words = ("compile", "--config-file", "cli.yaml", "-b", "here:here:pc", "--build-path", "built", "sketch")
    run(cli, *words, folder=work)
    run(work / "built/program", folder=work)
    objects = len(list((work / "built/libraries").rglob("*.c.o")))
    if objects != len(list(library.rglob("*.c"))):
        raise RefusedError(f"arduino-cli made {objects} objects")
    return objects


CHECKS: dict[str, tuple[str, Callable[[Path, Path], str]]] = {
    "PlatformIO": ("bslam-platformio-{}.tar.gz", platformio),
    "ESP-IDF": ("bslam-esp-idf-{}.tar.gz", esp_idf),
    "Zephyr": ("", zephyr),
    "Arduino": ("bslam-arduino-{}.zip", arduino),
}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("packages", type=Path, help="the folder that `make packages` wrote")
    folder: Path = parser.parse_args().packages.resolve()
    number = json.loads((ROOT / "library.json").read_text(encoding="utf-8"))["version"]
    failed = False
    for name, (archive, check) in CHECKS.items():
        with tempfile.TemporaryDirectory() as work:
            try:
                said = check(folder / archive.format(number), Path(work))
            except RefusedError as error:
                said, failed = f"REFUSED: {error}", True
        print(f"{name}: {said}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
