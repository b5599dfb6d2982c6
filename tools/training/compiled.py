"""An exported machine as the C compiler sees it: the header compiled with the C core, and called.

What scikit-learn decides and what the firmware will decide are compared with it, sample by sample.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tools.training.fit import Matrix, expand

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
TOLERANCE = 1e-5
"""Largest difference allowed, as a share of 1 + sum |w_k phi_k(x)|: float32 decides, double trained."""

_SHIM = """#include "vision/built_in/classifiers/svm.h"
#include "{header}"
int check(int features);
int rows(void);
int features(void);
int quadratic(void);
void decide(const float *x, float *values);
void table(float *weights);
int check(int features) {{ return (int)bslam_svm_check(&{svm}, features); }}
int rows(void) {{ return {svm}.rows; }}
int features(void) {{ return {svm}.features; }}
int quadratic(void) {{ return {svm}.quadratic; }}
void decide(const float *x, float *values) {{ bslam_svm_decide(&{svm}, x, values); }}
void table(float *weights)
{{
    const int n = BSLAM_SVM_WEIGHTS({svm}.features, {svm}.quadratic);
    for (int i = 0; i < {svm}.rows * n; i++)
        weights[i] = {svm}.weights ? {svm}.weights[i] : {svm}.byte_scale[i / n] * (float){svm}.bytes[i];
}}
"""


def compile_library(folder: Path, source: str) -> ctypes.CDLL:
    """A library of `source` and the core's SVM; headers may lie in `folder`; a warning is an error."""
    file, library = folder / "library.c", folder / "library.so"
    file.write_text(source, encoding="utf-8")
    flags = ["-std=c11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion"]
    flags += ["-Wno-unused-const-variable"]  # a header holds more than one machine
    command = [os.environ.get("CC", "cc"), *flags, f"-I{FIRMWARE}", f"-I{folder}", "-shared", "-fPIC"]
    command += [str(file), str(FIRMWARE / "vision/built_in/classifiers/svm.c"), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return ctypes.CDLL(str(library))


class CompiledSvm:
    """The machine that the C expression `svm` (a bslam_svm_t) denotes in a header's text."""

    def __init__(self, header: str, svm: str) -> None:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "machine.h").write_text(header, encoding="utf-8")
            self._library = compile_library(Path(folder), _SHIM.format(header="machine.h", svm=svm))
        self.rows = int(self._library.rows())
        self.features = int(self._library.features())
        self.quadratic = bool(self._library.quadratic())

    def check(self, features: int) -> int:
        """The status of bslam_svm_check, 0 being good."""
        return int(self._library.check(features))

    def decide(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Decision values (samples, rows)."""
        x = np.ascontiguousarray(x, dtype=np.float32)
        values = np.empty((len(x), self.rows), dtype=np.float32)
        for sample, out in zip(x, values, strict=True):
            self._library.decide(_pointer(sample), _pointer(out))
        return values

    def weights(self) -> NDArray[np.float32]:
        """(rows, weights in a row); of bytes what they stand for."""
        weights = np.empty(
            (self.rows, expand(np.zeros((1, self.features)), self.quadratic).shape[1]), np.float32
        )
        self._library.table(_pointer(weights))
        return weights


def worst_difference(machine: CompiledSvm, x: NDArray[np.float32], wanted: Matrix) -> float:
    """The largest |decided - wanted| / (1 + sum |w_k phi_k(x)|) over all samples and rows."""
    weights = np.abs(machine.weights().astype(np.float64))
    magnitude = 1.0 + expand(np.abs(x), machine.quadratic) @ weights.T
    return float(np.max(np.abs(machine.decide(x) - wanted) / magnitude))


def worst_byte_difference(machine: CompiledSvm, x: NDArray[np.float32], wanted: Matrix) -> float:
    """The same of a quadratic machine with byte weights, in its own roundings: what svm.h says of bytes.

    One is a step of its whole numbers on every weight; 1.5 is allowed.
    """
    largest = np.maximum(1.0, np.abs(x).max(axis=1, keepdims=True)).astype(np.float64)
    step = largest**2 / 16383 * np.abs(machine.weights().astype(np.float64)).sum(axis=1)
    return float(np.max(np.abs(machine.decide(x) - wanted) / (step + 1e-30)))


def _pointer(array: NDArray[np.float32]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)
