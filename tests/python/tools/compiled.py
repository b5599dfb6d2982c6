"""A support vector machine as the C compiler sees it: its header compiled with the C core, and called."""

import ctypes
import os
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FIRMWARE = Path(__file__).parents[3] / "firmware"


def compile_library(folder: Path, source: str) -> ctypes.CDLL:
    """A library of `source` and the core's SVM, warnings being errors as in the firmware build."""
    file = folder / "library.c"
    file.write_text(source, encoding="utf-8")
    flags = ["-std=c11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion"]
    command = [os.environ.get("CC", "cc"), *flags, f"-I{FIRMWARE}", f"-I{folder}", "-shared", "-fPIC"]
    command += [str(file), str(FIRMWARE / "bslam/svm/svm.c"), "-o", str(folder / "library.so"), "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return ctypes.CDLL(str(folder / "library.so"))


class CompiledSvm:
    """The machine that the C expression `svm` (a bslam_svm_t) denotes once `header` is included."""

    def __init__(self, folder: Path, header: str, svm: str) -> None:
        self._library = compile_library(
            folder,
            f'#include "{header}"\n'
            f"int check(int features);\nvoid decide(const float *x, float *values);\n"
            f"int check(int features) {{ return (int)bslam_svm_check(&{svm}, features); }}\n"
            f"void decide(const float *x, float *values) {{ bslam_svm_decide(&{svm}, x, values); }}\n",
        )

    def check(self, features: int) -> int:
        return self._library.check(features)

    def decide(self, x: NDArray[np.float32], rows: int) -> NDArray[np.float32]:
        """Decision values (samples, rows)."""
        x = np.ascontiguousarray(x, dtype=np.float32)
        values = np.empty((len(x), rows), dtype=np.float32)
        pointer = ctypes.POINTER(ctypes.c_float)
        for sample, out in zip(x, values, strict=True):
            self._library.decide(sample.ctypes.data_as(pointer), out.ctypes.data_as(pointer))
        return values
