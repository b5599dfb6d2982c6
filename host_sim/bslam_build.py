"""How the C sources become Python extensions (cffi, API mode): for pip, for make, for tests and training.

The declarations that cffi reads are the real headers, run through the C preprocessor with the C library's
own headers left empty: there is no second copy. `python setup.py build_ext --inplace` puts the extensions
beside the modules that load them; what is newer than its sources is left alone.
"""

from __future__ import annotations

import copy
import hashlib
import os
import re
import runpy
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import setuptools
from cffi import FFI
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError
from setuptools.modified import newer_group

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE_DIR = ROOT / "firmware"
CAMERA_DIR = ROOT / "host_sim" / "bslam" / "world" / "camera"
BUILDS_FILE = ROOT / "host_sim" / "bslam" / "core" / "builds.py"
BUILDS: dict[str, Any] = runpy.run_path(str(BUILDS_FILE))
"""Names and sizes, read as a file: to import the package takes numpy, and to build it must not."""

SOURCES = {"bslam": ("base", "bslam"), "vision": ("base", "vision"), "link": ("base", "link")}
"""Folders of the firmware that make each library."""
HEADER = "bslam/bslam.h"
VISION_HEADER = "vision/vision.h"
RENDER_HEADER = "render.h"
CONSTANTS = "\n".join(
    f"#define {name} ..."
    for name in ("BSLAM_SIZES_HASH", "BSLAM_SAMPLE_FEATURES", "BSLAM_SEEDS_MAX", "BSLAM_CLASS_NOT_MAPPABLE")
)
"""Macros of the header that are needed here: the preprocessor leaves none."""
CALLBACKS = """
extern "Python" bool sink_write(void *, const void *, uint32_t);
extern "Python" bool source_read(const void *, uint32_t, void *, uint32_t);
extern "Python" bool flash_erase(void *, int);
extern "Python" bool flash_write(void *, int, uint32_t, const void *, uint32_t);
extern "Python" bool flash_read(void *, int, uint32_t, void *, uint32_t);
"""
"""What bslam_map_sink_t, bslam_map_source_t and bslam_flash_t call: raw.py."""
BEACONS_HEADER = FIRMWARE_DIR / "models" / "beacons.h"

LIBC_HEADERS = ("stdint.h", "stdbool.h", "stddef.h", "string.h", "math.h", "limits.h", "float.h")

Macros = Sequence[tuple[str, str]]

VISION_MACROS: Macros = (
    ("BSLAM_IMAGE_WIDTH_MAX", "640"),
    ("BSLAM_IMAGE_HEIGHT_MAX", "480"),
    ("BSLAM_PROPOSALS_MAX", "240"),
)
"""Room for a 180-degree lens of 320x240 that is looked at doubled."""

FLAGS = [
    "-std=c11",
    "-O3",  # the loops over pixels are written plainly: half the instructions of -O2
    "-g0",  # else five times as large
    "-ffp-contract=off",  # it would change the last bit from one machine to the next
    "-fvisibility=hidden",
    "-w",
    "-Wno-psabi",  # how four numbers are passed: no such call is left
    "-Werror=implicit-function-declaration",
]
CAMERA_FLAGS = ["-fno-math-errno", "-fno-trapping-math"]
"""Nobody reads errno or floating-point traps: without that promise the tracing loop gets no vectors."""
IS_ABI3 = os.name == "posix"
"""One build serves every Python: setuptools gives Windows no such name."""
MORE_FLAGS = "BSLAM_CFLAGS"
"""A variable whose flags come last: -O1 for a build that shall be quick."""

NEEDED = (
    "bslam needs a C compiler, gcc or clang, and '{program}' is not here; allowed: CC=PROGRAM, or to install "
    "one (Debian: apt-get install gcc python3-dev; macOS: xcode-select --install; Windows: MinGW-w64)"
)


def macros_of(real: str, beacons_max: int) -> Macros:
    """The sizes of one build: it has all that the estimator may have."""
    return [
        ("BSLAM_REAL_DOUBLE", "1" if real == "double" else "0"),
        ("BSLAM_BEACONS_MAX", str(beacons_max)),
        ("BSLAM_RAYS_MAX", str(beacons_max)),
        ("BSLAM_SIGHTINGS_MAX", str(BUILDS["sightings_max"](beacons_max))),
        ("BSLAM_HISTORY_MAX", "128"),
        ("BSLAM_APPEARANCE", "1"),
        ("BSLAM_SMOOTHER", "1"),
        ("BSLAM_HYPOTHESES_MAX", "8"),
        ("BSLAM_GUARD", "2"),
    ]


class Extension(setuptools.Extension):
    """A module, `name`: what a header declares, and the C files below `folders` of `root` that define it.

    declares: what cffi shall know beyond the header. defines: C that goes with it. Every extension says what
    it was made of: SOURCES_DIGEST, a string.
    """

    def __init__(
        self,
        name: str,
        root: Path,
        folders: Sequence[str],
        header: str,
        *,
        macros: Macros = (),
        declares: str = "",
        defines: str = "",
        flags: Sequence[str] = (),
    ) -> None:
        files = sorted(path for one in folders for path in (root / one).rglob("*.[ch]"))
        models = [BEACONS_HEADER] if str(BEACONS_HEADER.name) in defines else []
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in [*files, *models])).hexdigest()
        self.header, self.preprocessed = header, root / header
        self.declares = f"{declares}\nstatic char *const SOURCES_DIGEST;\n"
        self.defines = f'#include "{header}"\n{defines}\n#define SOURCES_DIGEST "{digest}"\n'
        super().__init__(
            name,
            [os.path.relpath(path, ROOT) for path in files if path.suffix == ".c"],
            depends=[__file__, *map(str, [BUILDS_FILE, *files, *models])],
            include_dirs=[str(root)],
            define_macros=list(macros),
            extra_compile_args=[*FLAGS, *flags, *os.environ.get(MORE_FLAGS, "").split()],
            extra_link_args=["-Wl,-s"] if sys.platform == "linux" else [],
            libraries=["m"],
            py_limited_api=IS_ABI3,
        )


def estimator(
    name: str, real: str, beacons_max: int, header: str = HEADER, *, declares: str = CONSTANTS + CALLBACKS
) -> Extension:
    """The filter for a scalar type and size class."""
    macros = macros_of(real, beacons_max)
    return Extension(name, FIRMWARE_DIR, SOURCES["bslam"], header, macros=macros, declares=declares)


def vision(name: str, header: str = VISION_HEADER) -> Extension:
    """The vision library, in float as on the target, with its model where there is one yet."""
    declares = "#define BSLAM_VISION_HASH ...\nconst bslam_beacon_model_t *built_in_model(void);\n"
    include, model = "", "NULL"
    if BEACONS_HEADER.is_file():
        include = f'#include "models/{BEACONS_HEADER.name}"\n'
        model = "&bslam_beacons_model"
    function = f"static const bslam_beacon_model_t *built_in_model(void) {{ return {model}; }}\n"
    return Extension(
        name,
        FIRMWARE_DIR,
        SOURCES["vision"],
        header,
        macros=VISION_MACROS,
        declares=declares,
        defines=include + function,
    )


def shipped() -> list[setuptools.Extension]:
    """What the package loads: the filter by scalar type and size, the vision library, the ray caster."""
    filters = [
        estimator(BUILDS["extension_name"](real, size), real, size)
        for size in reversed(BUILDS["SIZE_CLASSES"])
        for real in BUILDS["REALS"]
    ]
    camera = Extension(BUILDS["CAMERA_EXTENSION"], CAMERA_DIR, ["."], RENDER_HEADER, flags=CAMERA_FLAGS)
    return [vision(BUILDS["VISION_EXTENSION"]), *filters, camera]


def _drop_inline_functions(text: str) -> str:
    """Takes inline functions out: cffi declares, it does not define."""
    kept = []
    at = 0
    for match in re.finditer(r"(?:static )?inline[^{;]*\{", text):
        if match.start() < at:
            continue
        kept.append(text[at : match.start()])
        depth, at = 1, match.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            at += 1
    kept.append(text[at:])
    return "".join(kept)


def _declarations(compiler: Any, extension: Extension) -> str:
    """The header of an extension, with all it includes, as cffi reads it."""
    macros = [
        *extension.define_macros,
        ("bslam_init_double", "bslam_init_sized"),  # one name for both scalar types
        ("__attribute__(x)", ""),
        ("INT_MAX", "2147483647"),
    ]
    with tempfile.TemporaryDirectory() as empty:
        for libc_header in LIBC_HEADERS:
            Path(empty, libc_header).touch()
        out = Path(empty, "declarations.i")
        folders = [empty, *extension.include_dirs]
        compiler.preprocess(
            str(extension.preprocessed), str(out), macros, folders, extra_postargs=["-P", "-nostdinc"]
        )
        text = out.read_text(encoding="utf-8")
    # Bytes of what there is are for the compiler to say: cffi reads no sizeof, no conditional expression.
    text = re.sub(r"\bbytes\[[^;]*\];", "bytes[...];", text)
    text = re.sub(r"\benum \{[^}]*sizeof[^}]*\};", "", text)
    return _drop_inline_functions(text)


class BuildExtensions(build_ext):
    """Several at a time, each in a folder of its own, since the same sources make other objects there."""

    def finalize_options(self) -> None:
        super().finalize_options()
        options: Any = self
        options.parallel = options.parallel or os.cpu_count() or 1
        if os.name == "nt":
            options.compiler = options.compiler or "mingw32"  # the sources are for gcc and clang

    def run(self) -> None:
        """Straight to where they belong: setuptools itself would go round by build/lib."""
        super(build_ext, self).run()

    def build_extensions(self) -> None:
        compiler: Any = self.compiler
        program = compiler.compiler_so[0]
        if shutil.which(program) is None:
            raise CompileError(NEEDED.format(program=program))
        super().build_extensions()

    def build_extension(self, extension: Extension) -> None:
        """Unless it is newer than its sources. Raises CompileError with what the compiler said."""
        target = Path(self.get_ext_fullpath(extension.name))
        for old in target.parent.glob(f"{target.name.split('.')[0]}.cpython-*"):
            old.unlink()  # of an older bslam, for one Python: import would take it before the .abi3.so
        if not (self.force or newer_group(extension.depends, str(target), "newer")):
            return
        work = Path(self.build_temp, extension.name)
        work.mkdir(parents=True, exist_ok=True)
        ffi = FFI()
        ffi.cdef(_declarations(self.compiler, extension) + extension.declares)
        ffi.set_source(extension.name, extension.defines)
        generated = work / f"{extension.name}.c"
        ffi.emit_c_code(str(generated))

        one, extension = copy.copy(self), copy.copy(extension)
        extension.sources = [*extension.sources, str(generated)]
        one.build_temp, one.build_lib, one.inplace = str(work), str(work), False
        super(BuildExtensions, one).build_extension(extension)
        # Replaced by a rename: a running process keeps the old file, an interrupted build leaves none.
        target.parent.mkdir(parents=True, exist_ok=True)
        Path(one.get_ext_fullpath(extension.name)).replace(target)


def build(extension: Extension, folder: Path) -> Path:
    """Builds one that the package does not have, into a folder; returns where."""
    distribution = setuptools.Distribution({"name": extension.name, "ext_modules": [extension]})
    command = BuildExtensions(distribution)
    command.build_lib, command.build_temp = str(folder), str(folder / "temp")
    command.ensure_finalized()
    command.run()
    return Path(command.get_ext_fullpath(extension.name))
