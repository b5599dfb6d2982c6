"""Builds the C library into Python extensions, one a scalar type and size class (cffi, API mode).

The declarations that cffi reads are the real headers, run through the C preprocessor with the C library's own
headers left empty: there is no second copy. `python -m bslam.core.build` builds them beside this file.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from cffi import FFI

from bslam.core.builds import FIRMWARE_DIR, REALS, SIZE_CLASSES, VISION_EXTENSION, extension_name

CORE_DIR = Path(__file__).resolve().parent
SOURCES = {"bslam": ("base", "bslam"), "vision": ("base", "vision"), "link": ("base", "link")}
"""Folders of the firmware that make each library."""
HEADER = "bslam/bslam.h"
VISION_HEADER = "vision/vision.h"
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


def macros_of(real: str, beacons_max: int) -> Macros:
    """The sizes of one build: it has all that the estimator may have."""
    return [
        ("BSLAM_REAL_DOUBLE", "1" if real == "double" else "0"),
        ("BSLAM_BEACONS_MAX", str(beacons_max)),
        ("BSLAM_RAYS_MAX", str(beacons_max)),
        ("BSLAM_SIGHTINGS_MAX", str(min(max(64, beacons_max + 16), 250))),  # every beacon, and some clutter
        ("BSLAM_HISTORY_MAX", "128"),
        ("BSLAM_APPEARANCE", "1"),
        ("BSLAM_SMOOTHER", "1"),
        ("BSLAM_HYPOTHESES_MAX", "8"),
        ("BSLAM_GUARD", "2"),
    ]


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


def declarations(macros: Macros, header: str) -> str:
    """A header of the firmware, "bslam/bslam.h" say, with all it includes, as cffi reads it."""
    with tempfile.TemporaryDirectory() as empty:
        for libc_header in LIBC_HEADERS:
            Path(empty, libc_header).touch()
        defines = [f"-D{name}={value}" for name, value in macros]
        defines.append("-Dbslam_init_double=bslam_init_sized")  # one name for both scalar types
        command = [os.environ.get("CC", "cc"), "-E", "-P", "-nostdinc", f"-I{empty}", f"-I{FIRMWARE_DIR}"]
        command += [*defines, "-D__attribute__(x)=", "-DINT_MAX=2147483647", str(FIRMWARE_DIR / header)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # How many bytes an instance has is for the compiler to say: cffi reads no conditional expression.
    text = re.sub(r"\bbytes\[[^;]*\];", "bytes[...];", text)
    return _drop_inline_functions(text)


def build(real: str, beacons_max: int) -> Path:
    """Builds the filter for a scalar type and size class; returns where."""
    macros = macros_of(real, beacons_max)
    declared = declarations(macros, HEADER) + CONSTANTS + CALLBACKS
    name = extension_name(real, beacons_max)
    return compile_extension(name, declared, f'#include "{HEADER}"', macros, "bslam")


def build_vision(name: str = VISION_EXTENSION, header: str = VISION_HEADER, folder: Path = CORE_DIR) -> Path:
    """Builds the vision library, in float as on the target, with its model where there is one yet."""
    text = declarations(VISION_MACROS, header) + "#define BSLAM_VISION_HASH ...\n"
    text += "const bslam_beacon_model_t *built_in_model(void);\n"
    includes, model = f'#include "{header}"\n', "NULL"
    if BEACONS_HEADER.is_file():
        includes += f'#include "{BEACONS_HEADER.relative_to(FIRMWARE_DIR)}"\n'
        model = "&bslam_beacons_model"
    function = f"static const bslam_beacon_model_t *built_in_model(void) {{ return {model}; }}\n"
    return compile_extension(name, text, includes + function, VISION_MACROS, "vision", folder)


def compile_extension(
    name: str, declared: str, source: str, macros: Macros, library: str, folder: Path = CORE_DIR
) -> Path:
    """Compiles one extension and puts it into a folder; returns where."""
    ffi = FFI()
    ffi.cdef(declared)
    with tempfile.TemporaryDirectory() as work:
        ffi.set_source(
            name,
            source,
            sources=sorted(
                str(path) for folder in SOURCES[library] for path in (FIRMWARE_DIR / folder).rglob("*.c")
            ),
            include_dirs=[str(FIRMWARE_DIR)],
            define_macros=list(macros),
            extra_compile_args=[
                "-std=c11",
                "-O3",  # the loops over pixels are written plainly: half the instructions of -O2
                "-ffp-contract=off",
                "-fvisibility=hidden",
                "-w",
                "-Wno-psabi",  # how four numbers are passed: no such call is left
                "-Werror=implicit-function-declaration",
            ],
            libraries=["m"],
        )
        built = Path(ffi.compile(tmpdir=work, verbose=False))
        target = folder / (name.rsplit(".", 1)[-1] + sysconfig.get_config_var("EXT_SUFFIX"))
        # Replaced by a rename: a running process keeps the old file, an interrupted build leaves none.
        part = target.with_suffix(".part")
        shutil.copyfile(built, part)
        part.replace(target)
    return target


def main() -> int:
    """Builds every extension, one on a core (in processes, since cffi changes the directory)."""
    sizes, reals = zip(*[(size, real) for size in SIZE_CLASSES for real in REALS], strict=True)
    with ProcessPoolExecutor() as pool:
        vision = pool.submit(build_vision)
        for path in [*pool.map(build, reals, sizes), vision.result()]:
            print(f"built {path.name}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
