"""Checks a linked firmware image: what must not be in it, and how deep its stack can get.

No double arithmetic, heap or printf, by the image's symbols. No recursion, and no more stack than the image
sets aside: the longest path through the call graph of the disassembled image, with each function's frame as
the compiler gives it (-fstack-usage), or as its instructions show (libgcc, libm, names that are not unique).
A call through a pointer may go to any function that CALLED_BY_POINTER names for its caller.

Exit status 0: all is well. 1: what is wrong, one finding a line.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tools.checks.check_symbols import UNWANTED_CALLS

CALLED_BY_POINTER = (
    (r"session_|take_message", r"(apply|answer)_"),
    (r"bslam_settings_preset", r"set_"),
    (r"bslam_slam_", r"bslam_associate_"),
    (r"(bslam_)?associate_", r"\w+_distance2"),
    (r"main", r"test_"),
    (r"read_head|kept_|port_(save|load)|read_slot|flush|read_map|bslam_slots_", r"(erase|write|read)$"),
    (r"bslam_codec_|d_at|read_(factor|values|all)", r"take_piece|write_piece|read_bytes|read_map"),
)
"""Callers, and whom they may call through a pointer."""

INTERRUPTS = ("systick_interrupt", "port_interrupt")
INTERRUPT_FRAME_BYTES = 26 * 4 + 4
"""What the core saves when it takes an interrupt: 8 registers, 18 of the FPU, and up to 4 bytes to align."""

FUNCTION = re.compile(r"^([0-9a-f]+) <(.+)>:$")
INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\t(\S+)(?:\t(.*))?$")
GROWS_STACK = re.compile(r"(?:subw? sp(?:, sp)?, #|str .*\[sp, #-|addi sp,sp,-)(\d+)")
RISCV_CALLS = ("jal", "jalr", "j", "tail", "call")
TARGET = re.compile(r"\b([0-9a-f]+) <([^>+]+)>")


@dataclass
class Function:
    """A function of the image: its frame, whom it calls by address, whether it calls through a pointer."""

    name: str
    address: int
    frame_bytes: int = 0
    calls: set[int] = field(default_factory=set)
    calls_pointer: bool = False
    popped: str = ""  # the registers of the last pop: an ARMv6-M returns by one of them


def read_functions(listing: str) -> dict[int, Function]:
    """The functions in the output of `objdump --disassemble --no-show-raw-insn`, by address."""
    functions: dict[int, Function] = {}
    present: Function | None = None
    for line in listing.splitlines():
        if match := FUNCTION.match(line):
            address = int(match[1], 16)
            present = functions.setdefault(address, Function(match[2], address))
        elif present is not None and (match := INSTRUCTION.match(line)):
            _read_instruction(present, match[1].split(".")[0], match[2] or "")
    for function in functions.values():
        function.calls &= set(functions)
    return functions


def _read_instruction(function: Function, name: str, operands: str) -> None:
    target = TARGET.search(operands)
    jumps = name in ("jr", "jalr", "bx", "blx") or (target and (name in RISCV_CALLS or name.startswith("b")))
    if jumps:
        _read_jump(function, name, operands, int(target[1], 16) if target else None)
    else:
        _read_stack(function, name, operands)


def _read_jump(function: Function, name: str, operands: str, target: int | None) -> None:
    """A jump to another function is a call at its end; one to the function's own start is a loop."""
    calls = ("bl", "blx", *RISCV_CALLS)
    returns = {"jr": ("ra",), "bx": ("lr", function.popped.strip("{}"))}
    if target is None:
        function.calls_pointer = function.calls_pointer or operands not in returns.get(name, ())
    elif name in calls or target != function.address:
        function.calls.add(target)


def _read_stack(function: Function, name: str, operands: str) -> None:
    if name == "pop":
        function.popped = operands
    elif name in ("push", "vpush"):
        function.frame_bytes += _listed_registers(operands) * (8 if "d" in operands.split("-")[0] else 4)
    elif name in ("stmdb", "vstmdb") and operands.startswith("sp!"):
        function.frame_bytes += 4 * _listed_registers(operands.split(",", 1)[1])
    elif match := GROWS_STACK.match(f"{name} {operands}"):
        function.frame_bytes += int(match[1])


def _listed_registers(operands: str) -> int:
    """How many registers a list such as {r4, r5, r8-r11, lr} has."""
    count = 0
    for item in operands.strip("{} ").split(","):
        ends = [int(number) for number in re.findall(r"\d+", item)]
        count += ends[1] - ends[0] + 1 if "-" in item else 1
    return count


def read_frames(folder: Path) -> dict[str, int]:
    """Bytes of stack by function, of the compiler's .su files; without names that several files use."""
    sizes: dict[str, set[int]] = {}
    for path in folder.rglob("*.su"):
        if not (Path(__file__).parents[2] / path.relative_to(folder)).with_suffix(".c").is_file():
            continue  # of a source that is gone
        for line in path.read_text(encoding="utf-8").splitlines():
            place, size, kind = line.split("\t")
            if "dynamic" in kind and "bounded" not in kind:
                raise SystemExit(f"{path}: {place}: a stack frame without bound")
            sizes.setdefault(place.rsplit(":", 1)[1], set()).add(int(size))
    return {name: max(found) for name, found in sizes.items() if len(found) == 1}


class CallGraph:
    """Who calls whom, and how deep the stack gets."""

    def __init__(self, functions: dict[int, Function], frames: dict[str, int]) -> None:
        self.faults: list[str] = []
        self._functions = functions
        self._depths: dict[int, tuple[int, list[str]]] = {}
        for function in functions.values():
            function.frame_bytes = frames.get(function.name, function.frame_bytes)
            if function.calls_pointer:
                function.calls |= self._pointed(function.name)

    def _pointed(self, caller: str) -> set[int]:
        for callers, callees in CALLED_BY_POINTER:
            if re.match(callers, caller):
                return {address for address, one in self._functions.items() if re.match(callees, one.name)}
        if not caller.startswith("__"):
            self.faults.append(f"{caller} calls through a pointer: whom? check_image.py, CALLED_BY_POINTER")
        return set()

    def frame(self, name: str) -> int:
        """Bytes of stack that a function takes by itself."""
        return max(one.frame_bytes for one in self._functions.values() if one.name == name)

    def deepest(self, name: str) -> tuple[int, list[str]]:
        """Bytes of stack from a function on, and the path that takes them."""
        starts = [address for address, one in self._functions.items() if one.name == name]
        return max((self._deepest(address, []) for address in starts), default=(0, []))

    def _deepest(self, address: int, above: list[int]) -> tuple[int, list[str]]:
        if address in above:
            names = [self._functions[one].name for one in [*above[above.index(address) :], address]]
            fault = f"recursion: {' > '.join(names)}"
            if fault not in self.faults:
                self.faults.append(fault)
            return 0, []
        if address not in self._depths:
            function = self._functions[address]
            below = [self._deepest(one, [*above, address]) for one in sorted(function.calls)]
            depth, path = max(below, default=(0, []))
            self._depths[address] = depth + function.frame_bytes, [function.name, *path]
        return self._depths[address]


def unwanted(listing: str) -> Iterator[str]:
    """Every function in the output of `nm --portability` that must not be in an image."""
    for line in listing.splitlines():
        name, kind = line.split()[:2]
        if kind in "TtWw" and UNWANTED_CALLS.match(name):
            yield f"{name} is in the image: heap, printf or double arithmetic"


def stack_room(listing: str) -> int:
    """Bytes that the image sets aside for its stack."""
    symbols = {line.split()[0]: int(line.split()[2], 16) for line in listing.splitlines()}
    return symbols["start_stack_top"] - symbols["start_stack_bottom"]


def output_of(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("image", type=Path, help="the linked ELF file")
    parser.add_argument("--objects", type=Path, required=True, help="folder of the compiler's .su files")
    parser.add_argument("--paths", action="store_true", help="print the paths that take the most stack")
    parser.add_argument("--tools", default="arm-none-eabi-", help="prefix of nm and objdump")
    options = parser.parse_args(argv)
    symbols = output_of(f"{options.tools}nm", "--portability", str(options.image))
    disassembly = output_of(f"{options.tools}objdump", "-d", "--no-show-raw-insn", str(options.image))
    graph = CallGraph(read_functions(disassembly), read_frames(options.objects))
    depth, path = graph.deepest("start_reset")
    interrupt = max(graph.deepest(name)[0] for name in INTERRUPTS)  # they do not nest
    needed, room = depth + interrupt + INTERRUPT_FRAME_BYTES, stack_room(symbols)
    findings = [*unwanted(symbols), *graph.faults]
    if needed > room:
        findings.append(f"{needed} bytes of stack at worst, {room} are there: {' > '.join(path)}")
    for finding in findings:
        print(f"{options.image}: {finding}", file=sys.stderr)
    if options.paths:
        for name in ("start_reset", "bslam_slam_sightings"):
            print(" > ".join(f"{one} {graph.frame(one)}" for one in graph.deepest(name)[1]))
    steps = {name: graph.deepest(name)[0] for name in ("bslam_slam_odometry", "bslam_slam_sightings")}
    told = ", ".join(f"{name} {size}" for name, size in steps.items())
    print(f"{options.image}: stack {needed} of {room} bytes at worst ({told})")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
