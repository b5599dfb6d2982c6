"""Builds the ray caster into a Python extension (cffi, API mode) beside this file.

The declarations that cffi reads are the real header, run through the C preprocessor. Run it as a file,
`python host_sim/bslam/world/camera/build.py`: the package cannot be imported before it is built.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from cffi import FFI

EXTENSION = "bslam.world.camera._render"
CAMERA_DIR = Path(__file__).resolve().parent

# Contraction would change the last bit from one machine to the next; without the other two promises (nobody
# reads errno or floating-point traps) the compiler may not turn the tracing loop into vector instructions.
COMPILE_ARGS = [
    "-std=c11",
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fvisibility=hidden",
    "-w",
    "-Werror=implicit-function-declaration",
]


def declarations() -> str:
    """The header as cffi reads it."""
    with tempfile.TemporaryDirectory() as empty:
        Path(empty, "stdint.h").touch()
        command = [os.environ.get("CC", "cc"), "-E", "-P", "-nostdinc", f"-I{empty}"]
        command += [str(CAMERA_DIR / "render.h")]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def build() -> Path:
    """Compiles the extension and puts it beside this file; returns where."""
    ffi = FFI()
    ffi.cdef(declarations())
    with tempfile.TemporaryDirectory() as work:
        ffi.set_source(
            EXTENSION,
            '#include "render.h"',
            sources=sorted(str(CAMERA_DIR / name) for name in ("trace.c", "shade.c", "sensor.c")),
            include_dirs=[str(CAMERA_DIR)],
            extra_compile_args=COMPILE_ARGS,
            libraries=["m"],
        )
        built = Path(ffi.compile(tmpdir=work, verbose=False))
        target = CAMERA_DIR / (EXTENSION.rsplit(".", 1)[1] + sysconfig.get_config_var("EXT_SUFFIX"))
        # Replaced by a rename: a running process keeps the old file, an interrupted build leaves none.
        part = target.with_suffix(".part")
        shutil.copyfile(built, part)
        part.replace(target)
    return target


def main() -> int:
    print(f"built {build().name}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
