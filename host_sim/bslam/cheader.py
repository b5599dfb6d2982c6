"""C headers of trained models: constant tables and the views on them, for firmware/models.

A header opens with a comment that says where the weights come from and how good they were, with their sha256.
The same model gives the same bytes. Floats have nine significant digits, which give every float32 back.
"""

from __future__ import annotations

import hashlib
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bslam.errors import BslamError
from bslam.modelfile import AdditiveSvm, BeaconClass, HingedSvm, Svm
from bslam.scannerfile import ScannerModel

COLUMNS = 110
NAME = re.compile(r"[a-z][a-z0-9_]*")


def weights_sha256(arrays: Sequence[NDArray[np.generic]]) -> str:
    """Of the tables' bytes, little-endian, in order: tells whether two headers hold the same model."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


class Header:
    """A C header that grows from the top: tables first, then the views that name them."""

    def __init__(self, guard: str, includes: Sequence[str], notes: Mapping[str, str]) -> None:
        """`notes`: training set, settings, figures; a line of the opening comment each."""
        self._guard = guard
        self._includes = includes
        self._notes = notes
        self._body: list[str] = []
        self._arrays: list[NDArray[np.generic]] = []

    def array(self, name: str, values: NDArray[np.generic]) -> str:
        """Add a table of float32, int8, uint8 or int32; its name."""
        kind = {"float32": "float", "int8": "int8_t", "uint8": "uint8_t", "int32": "int32_t"}[
            values.dtype.name
        ]
        self._arrays.append(values)
        numbers = ", ".join(map(c_float if kind == "float" else str, values.ravel().tolist()))
        lines = textwrap.fill(
            numbers, COLUMNS, initial_indent="    ", subsequent_indent="    ", break_long_words=False
        )
        self._body.append(f"static const {kind} {name}[{values.size}] = {{\n{lines},\n}};")
        return name

    def svm(self, name: str, svm: Svm) -> str:
        """Add the tables of a machine; the initialiser of its bslam_svm_t."""
        weights = bytes_ = byte_scale = "NULL"
        if svm.byte_scale is None:
            weights = self.array(f"{name}_weights", svm.weights)
        else:
            bytes_ = self.array(f"{name}_bytes", svm.weights)
            byte_scale = self.array(f"{name}_byte_scale", svm.byte_scale)
        bias = self.array(f"{name}_bias", svm.bias)
        quadratic = "true" if svm.quadratic else "false"
        return initialiser([str(svm.rows), str(svm.features), quadratic, weights, bytes_, byte_scale, bias])

    def additive(self, name: str, machine: AdditiveSvm) -> str:
        """Add the tables of an additive machine; the initialiser of its bslam_additive_t."""
        fields = [str(machine.rows), str(machine.features), self.array(f"{name}_knots", machine.knots)]
        fields.append(str(len(machine.crossed)))
        fields.append(self.array(f"{name}_crossed", machine.crossed) if len(machine.crossed) else "NULL")
        fields.append(self.array(f"{name}_bytes", machine.paired))
        fields.append(self.array(f"{name}_byte_scale", machine.byte_scale))
        fields.append(self.array(f"{name}_bias", machine.bias))
        return initialiser(fields)

    def hinged(self, name: str, machine: HingedSvm) -> str:
        """Add the tables of a hinged machine; the initialiser of its bslam_hinged_t."""
        return initialiser(
            [
                str(machine.rows),
                str(machine.features),
                self.array(f"{name}_knots", machine.knots),
                self.array(f"{name}_bytes", machine.paired),
                self.array(f"{name}_byte_scale", machine.byte_scale),
                self.array(f"{name}_bias", machine.bias),
            ]
        )

    def classes(self, name: str, classes: Sequence[BeaconClass]) -> str:
        """Add a table of kinds; its name."""
        rows = [[c_string(one.name), *map(c_float, astuple(one)[1:])] for one in classes]
        return self.rows("bslam_beacon_class_t", name, rows)

    def rows(self, kind: str, name: str, rows: Sequence[Sequence[str]]) -> str:
        """Add a table of structs of a type of the library, a row of members each; its name."""
        lines = "".join(
            textwrap.fill(
                ", ".join(row[1:]) + "},",
                COLUMNS,
                initial_indent=f"    {{{row[0]}, ",  # a name, which is not to be broken
                subsequent_indent="     ",
            )
            + "\n"
            for row in rows
        )
        self._body.append(f"static const {kind} {name}[{len(rows)}] = {{\n{lines}}};")
        return name

    def constant(self, kind: str, name: str, value: str) -> str:
        """Add a constant of a type of the core, from its initialiser; the expression that points to it."""
        self._body.append(f"static const {kind} {name} = {value};")
        return f"&{name}"

    def text(self) -> str:
        """The whole header."""
        notes = {**self._notes, "weights": f"sha256 {weights_sha256(self._arrays)}"}
        comment = "".join(_comment_lines(notes))
        includes = "".join(f'#include "{path}"\n' for path in self._includes)
        body = "\n\n".join(self._body)
        return (
            f"// Generated by bslam/cheader.py; do not edit.\n//\n{comment}"
            f"#ifndef {self._guard}\n#define {self._guard}\n\n{includes}\n{body}\n\n#endif\n"
        )


def initialiser(values: Sequence[str]) -> str:
    """`{value, ...}`: every member of a struct in its order, so that C++ takes it, too."""
    return "{" + ", ".join(values) + "}"


def named_initialiser(fields: Mapping[str, str], depth: int = 1) -> str:
    """The same, a member a line, with its name beside it; `depth` times indented."""
    indent = "    " * depth
    lines = "".join(f"{indent}{value},  // {name}\n" for name, value in fields.items())
    return "{\n" + lines + indent[4:] + "}"


def c_float(value: float) -> str:
    """A float constant of C with nine significant digits: 0.100000001f, 2.0f."""
    text = f"{float(np.float32(value)):.9g}"
    return f"{text if re.search('[.e]', text) else f'{text}.0'}f"


def c_string(text: str) -> str:
    """A string constant of C; what is not printable ASCII as octal bytes of UTF-8, which end after three."""
    plain = {byte: chr(byte) for byte in range(32, 127)} | {34: '\\"', 92: "\\\\", 63: "\\?"}
    return '"' + "".join(plain.get(byte, f"\\{byte:03o}") for byte in text.encode()) + '"'


def check_name(name: str) -> None:
    """BslamError unless a header may be called so."""
    if not NAME.fullmatch(name):
        allowed = "small letters, digits and _, a letter first: it becomes a name in C"
        raise BslamError(f"header {name}.h: the name is not allowed; allowed: {allowed}")


def scanner_header(model: ScannerModel, name: str) -> str:
    """The header of a scanner: `static const bslam_scanner_model_t bslam_<name>`."""
    check_name(name)
    header = Header(f"BSLAM_MODELS_{name.upper()}_H", ["vision/vision.h"], model.notes)
    windows = []
    for index, window in enumerate(model.windows):
        its = f"{name}_{index}"
        windows.append(
            [
                str(window.kind),
                str(window.columns),
                str(window.rows),
                c_float(window.box_columns),
                c_float(window.box_rows),
                header.array(f"{its}_weights", window.weights),
                c_float(window.scale),
                str(window.bias),
                header.array(f"{its}_coarse", window.coarse),
                str(window.coarse_bias),
                header.array(f"{its}_order", window.order),
                header.array(f"{its}_floors", window.floors),
                header.array(f"{its}_edges", window.edges),
                header.array(f"{its}_edge_scale", window.edge_scale),
                header.array(f"{its}_edge_bias", window.edge_bias),
            ]
        )
    kinds = [[c_string(one.name), *map(c_float, astuple(one)[1:])] for one in model.kinds]
    fields = {
        "kind_count": str(len(kinds)),
        "kinds": header.rows("bslam_scan_kind_t", f"{name}_kinds", kinds),
        "window_count": str(len(windows)),
        "windows": header.rows("bslam_window_t", f"{name}_windows", windows),
    }
    header.constant("bslam_scanner_model_t", f"bslam_{name}", named_initialiser(fields))
    return header.text()


def write_header(path: Path, text: str) -> None:
    """Write a header; its folder is made if need be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _comment_lines(notes: Mapping[str, str]) -> Iterator[str]:
    for name, value in notes.items():
        for number, line in enumerate(textwrap.wrap(f"{name}: {value}", COLUMNS - 5)):
            yield f"// {'' if number == 0 else '  '}{line}\n"
