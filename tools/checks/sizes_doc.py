"""Writes docs/SIZES.md: flash, RAM, stack and instructions of the firmware, all measured here.

With --check nothing is written: exit status 1 if a figure of the file is more than 2 % off what is measured
now, one finding a line. Whoever accepts the change writes the file anew.
"""

import argparse
import re
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bslam.target.lines import BUILD_DIR, NS_PER_INSTRUCTION, QEMU, ROOT, emulator_of, qemu_machines
from tools.checks.check_image import CallGraph, output_of, read_frames, read_functions
from tools.checks.markdown import Row, table
from tools.checks.sizes import MEMBERS, instance_bytes
from tools.proofs.run_image import run_image
from tools.training.render_set import RIGS, camera_of, render_world

FILE = ROOT / "docs" / "SIZES.md"
TOLERANCE = 0.02
TICKS_HZ = 25_000_000
"""Of the emulated boards (port_ticks_hz)."""
INSTRUCTIONS_A_TICK = 1e9 / TICKS_HZ / NS_PER_INSTRUCTION
WORLD_SEED, FRAMES = 7000, 3
PICTURES_AT = 0x20200000
"""As in firmware/bench/cost_vision.c: the upper half of the boards' 4 MB, which no image uses."""
PIXELS = 320 * 240
STEPS_A_SECOND, CORE_HZ = 25, 168_000_000
COST_BOARDS = {"Cortex-M0+": "mps2_an385", "Cortex-M4F": "mps2_an386", "Cortex-M7": "mps2_an500"}
BEACONS = (6, 20, 50)
M4F = "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard"
COMPILER = f"arm-none-eabi-gcc -std=c11 -ffp-contract=off -I{ROOT / 'firmware'} -mthumb {M4F} -Os"
NM = "arm-none-eabi-nm"
STEP_FUNCTIONS = ("bslam_slam_odometry", "bslam_slam_sightings")
VISION_FUNCTIONS = ("bslam_vision_row", "bslam_vision_end")
VISION_PARTS = {
    "frame": "built-in kinds",
    "rows": "a scanner's channels, as rows come",
    "scan": "a scanner's windows: five kinds",
}
"""What firmware/bench/cost_vision.c prints, and what it is."""
PARTS = {
    "predict": "odometry and an empty frame",
    "step": "odometry and a frame of 3 sightings with distance, known association",
    "filter": "of that the filter's own functions",
    "predict_velocity": "predict, with velocity states",
    "step_velocity": "step, with velocity states",
    "filter_velocity": "filter, with velocity states",
    "augment": "a frame that starts a beacon",
    "associate_mahalanobis": "3 sightings against the whole map",
    "train": "one training of a classifier, mean, on synthetic descriptors that are hard to separate",
}


def flash_by_layer() -> dict[str, int]:
    """Code and constants of the libraries with all their members by layer, bytes."""
    found: dict[str, int] = defaultdict(int)
    folder = BUILD_DIR / "m4f_whole"
    for path in sorted(folder.rglob("*.o")):
        if not (ROOT / path.relative_to(folder)).with_suffix(".c").is_file():
            continue  # of a source that is gone
        text, data = output_of("arm-none-eabi-size", str(path)).splitlines()[1].split()[:2]
        found[str(path.parent.relative_to(folder / "firmware"))] += int(text) + int(data)
    return found


def linked_bytes(flags: str) -> int:
    """Code and constants that tests/bench/link_core.c takes of the estimator and of libc."""
    options = "-fno-math-errno -ffunction-sections -fdata-sections -nostartfiles"
    link = "--specs=nano.specs --specs=nosys.specs -Wl,--gc-sections,--entry=main,--no-warn-rwx-segments -lm"
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "core.elf"
        sources = [path for part in ("base", "bslam") for path in (ROOT / "firmware" / part).rglob("*.c")]
        files = [str(path) for path in (ROOT / "tests" / "bench" / "link_core.c", *sorted(sources))]
        words = f"{COMPILER} {options} -DBSLAM_SETTING_MEANINGS=0 {flags}".split()
        output_of(*words, *files, *link.split(), "-o", str(image))
        text, data = output_of("arm-none-eabi-size", str(image)).splitlines()[1].split()[:2]
        symbols = output_of("arm-none-eabi-nm", "--portability", str(image)).splitlines()
        own = sum(int(line.split()[3], 16) for line in symbols if line.split()[0] in ("main", "robot_step"))
        return int(text) + int(data) - own


def linked_rows() -> Iterator[Row]:
    for members, flags in MEMBERS.items():
        yield members, linked_bytes(flags)


def image_sections(path: Path) -> tuple[int, int]:
    """Bytes of ROM and RAM of an image; the RAM without the stack."""
    sizes = defaultdict(int)
    for line in output_of("arm-none-eabi-size", "-A", str(path)).splitlines():
        words = line.split()
        if len(words) == 3 and words[1].isdigit():
            sizes[words[0]] = int(words[1])
    rom = sizes[".text"] + sizes[".note.gnu.build-id"] + sizes[".ARM.exidx"] + sizes[".data"]
    return rom, sizes[".data"] + sizes[".bss"] + sizes[".noinit"]


def stack_of(path: Path, functions: Sequence[str]) -> dict[str, int]:
    """Bytes of stack from a function on, in an image."""
    disassembly = output_of("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(path))
    graph = CallGraph(read_functions(disassembly), read_frames(path.parent))
    return {name: graph.deepest(name)[0] for name in functions}


def costs(board: str, program: str = "cost") -> dict[tuple[str, int], int]:
    """Instructions by part and number of beacons."""
    ended = run_image(board, program)
    if ended.status != 0:
        raise SystemExit(f"{program} on {board} ended with status {ended.status}: {ended.output}")
    lines = re.findall(r"^(?!state)(\w+) (\d+) (\d+)\r?$", ended.output, re.MULTILINE)
    return {(name, int(size)): round(int(ticks) * INSTRUCTIONS_A_TICK) for name, size, ticks in lines}


def picture_loader(lens: str, folder: Path, seed: int = WORLD_SEED, count: int = FRAMES) -> tuple[str, str]:
    """QEMU's arguments to put a walk of so many frames through a world where cost_vision.c looks for it."""
    frames = render_world(seed, "test", camera_of(lens, seed), count).pictures
    path = folder / f"{lens}.bin"
    head = np.array([lens == "wide", len(frames)], "<u4")
    path.write_bytes(head.tobytes() + frames.astype("<u2").tobytes())
    return "-device", f"loader,file={path},addr={PICTURES_AT:#x},force-raw=on"


def vision_costs() -> dict[tuple[str, str, str], int]:
    """Instructions of a frame, mean, by core, lens and part: VISION_PARTS."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for lens in RIGS:
            loader = picture_loader(lens, Path(folder))
            for core, board in COST_BOARDS.items():
                ended = run_image(board, "cost_vision", *loader)
                for part in VISION_PARTS:
                    lines = re.findall(rf"^{part} \d+ (\d+) ", ended.output, re.MULTILINE)
                    if ended.status != 0 or len(lines) != FRAMES:
                        raise SystemExit(f"cost_vision on {board}: status {ended.status}: {ended.output}")
                    found[core, lens, part] = round(sum(map(int, lines)) / FRAMES * INSTRUCTIONS_A_TICK)
    return found


def share(cost: int) -> str:
    return f"{100 * cost * STEPS_A_SECOND / CORE_HZ:.1f} %"


def budget(filter_costs: dict[tuple[str, int], int], frames: dict[str, int]) -> Iterator[Row]:
    """A second of a robot with 20 beacons: what each part takes of the core's instructions."""
    each = {
        "filter: `step_velocity`": filter_costs["step_velocity", 20],
        "association: `associate_mahalanobis`": filter_costs["associate_mahalanobis", 20],
        "learning: one `train` a step": filter_costs["train", 20],
    }
    rest = sum(each.values())
    for name, cost in each.items():
        yield (name, cost, share(cost))
    for lens, frame in frames.items():
        yield (f"vision: one QVGA frame a step, {lens}", frame, share(frame))
        yield (f"all, {lens}", rest + frame, share(rest + frame))


def flash_rows() -> list[Row]:
    flash = flash_by_layer()
    estimator = sum(size for name, size in flash.items() if name.split("/")[0] in ("base", "bslam"))
    return [*((name, flash[name]) for name in sorted(flash)), ("base and bslam, all of it", estimator)]


def ram_rows() -> Iterator[Row]:
    for members, flags in MEMBERS.items():
        yield (f"`bslam_t`, {members}", *(instance_bytes(COMPILER + flags, NM, n) for n in BEACONS))
    for what, name in (
        ("`bslam_vision_t`, QVGA, four cameras", "bslam_vision_t"),
        ("`bslam_scanner_t`", "bslam_scanner_t"),
    ):
        yield (what, *(instance_bytes(COMPILER, NM, n, name, "vision/vision.h") for n in BEACONS))


def image_rows() -> Iterator[Row]:
    """Of the boards with an Arm core: the tools of others need not be here."""
    for board in sorted(qemu_machines()):
        if emulator_of(board) == QEMU:
            yield (board, *image_sections(BUILD_DIR / board / "robot.elf"))


def smoother_rows() -> Iterator[Row]:
    measured = costs(COST_BOARDS["Cortex-M4F"], "cost_smoother")
    for (name, beacons), cost in measured.items():
        share = f"{100 * cost * STEPS_A_SECOND / CORE_HZ:.1f} %"
        yield (f"{name} step", beacons, cost, share)


def stack_rows(program: str, functions: Sequence[str]) -> Iterator[Row]:
    for core, board in COST_BOARDS.items():
        if not (BUILD_DIR / board / f"{program}.elf").is_file():
            continue  # no program for a core without an FPU
        yield (core, *stack_of(BUILD_DIR / board / f"{program}.elf", functions).values())


def cost_rows(measured: dict[str, dict[tuple[str, int], int]]) -> Iterator[Row]:
    for part in PARTS:
        for beacons in BEACONS:
            if (part, beacons) in measured["Cortex-M4F"]:
                yield (f"`{part}`", beacons, *(measured[core][part, beacons] for core in COST_BOARDS))


def vision_rows(measured: dict[tuple[str, str, str], int]) -> Iterator[Row]:
    for part, what in VISION_PARTS.items():
        for lens in RIGS:
            yield (what, lens, *(f"{measured[core, lens, part] / PIXELS:.0f}" for core in COST_BOARDS))


def code_heads(names: Sequence[str]) -> Row:
    return ["core", *(f"`{name}`" for name in names)]


def document() -> str:
    """The whole page."""
    measured = {core: costs(board) for core, board in COST_BOARDS.items()}
    parts = "".join(f"- `{name}`: {what}.\n" for name, what in PARTS.items())
    seeing = vision_costs()
    frames = {lens: seeing["Cortex-M4F", lens, "frame"] for lens in RIGS}
    return f"""# What bslam costs on a microcontroller

Written by `make sizes-doc`; `make test` fails if a figure is more than 2 % off. No board has run this yet: \
cores are emulated. Compiler: {output_of("arm-none-eabi-gcc", "--version").splitlines()[0]}.

## Flash

Code and constants of the libraries for a Cortex-M4F, `-Os`, by layer, bytes. A linker with `--gc-sections` \
takes only what is called.

{table(("layer", "bytes"), flash_rows())}
What a robot without a camera links of the estimator and of libc, bytes, by the members that config.h \
switches: odometry, sightings with and without distance, pose, covariance, map (tests/bench/link_core.c).

{table(("linked", "bytes"), linked_rows())}
## RAM

Instances, bytes, by `BSLAM_BEACONS_MAX`, on a Cortex-M4F; other sizes at their defaults. \
`make sizes BEACONS="12" SIZES=-DBSLAM_RAYS_MAX=0` prints others, and the host's. In C it is \
`BSLAM_BYTES`.

{table(("instance", *BEACONS), ram_rows())}
## Images

`robot.elf`, `-O2`, bytes; RAM without stack. MPS2 boards have room for 80 beacons, microbit for 6. \
stm32f405 learns appearance, stm32f405_seeing sees the built-in kinds by one QVGA camera, stm32f405_scanning \
a user's own; they have room for 20, 14 and 20.

{table(("image", "ROM", "RAM"), image_rows())}
## Stack

The longest path from a call on, bytes, along the call graph of the linked image \
(tools/checks/check_image.py).

{table(code_heads(STEP_FUNCTIONS), stack_rows("cost", STEP_FUNCTIONS))}
{table(code_heads(VISION_FUNCTIONS), stack_rows("cost_vision", VISION_FUNCTIONS))}
With the smoother linked:

{table(code_heads(STEP_FUNCTIONS), stack_rows("cost_smoother", STEP_FUNCTIONS))}
## Instructions

Counted by QEMU (`-icount`), the same at every run; instructions are not cycles. `-O2`, invariant filter, \
`firmware/bench/cost.c`. No board of QEMU has a Cortex-M0+: its image runs on a Cortex-M3.

{table(("part", "beacons", *COST_BOARDS), cost_rows(measured))}
{parts}
A bearing-only step with the smoother on a Cortex-M4F, its window full: 3 sightings a frame of 6 beacons, \
5 of 20 (firmware/bench/cost_smoother.c).

{table(("", "beacons", "instructions", f"of {CORE_HZ // 1_000_000} million a second"), smoother_rows())}
The camera front end, instructions a pixel, mean of {FRAMES} frames of 320x240 of a rendered world (seed \
{WORLD_SEED}; firmware/bench/cost_vision.c). By function, and in other worlds: \
`.venv/bin/python -m tools.bench.profile_image cost_vision --worlds 7000:7020 --frames 8`.

{table(("part", "lens", *COST_BOARDS), vision_rows(seeing))}
## A second on a Cortex-M4F

{STEPS_A_SECOND} steps a second with 20 beacons: instructions a step, and their share of \
{CORE_HZ // 1_000_000} million a second. Some instructions take more than a cycle, so the load is higher.

{table(("part", "instructions", "share"), budget(measured["Cortex-M4F"], frames))}"""


def differences(stands: str, measured: str) -> Iterator[str]:
    """Lines whose figures differ by more than the tolerance, or that are not there."""
    old, new = stands.splitlines(), measured.splitlines()
    if len(old) != len(new):
        yield f"{len(old)} lines stand, {len(new)} are measured"
        return
    number = re.compile(r"\b\d+(?:\.\d+)?\b")
    for before, now in zip(old, new, strict=True):
        if number.sub("", before) != number.sub("", now):
            yield f"stands: {before}\n  now: {now}"
            continue
        pairs = zip(map(float, number.findall(before)), map(float, number.findall(now)), strict=True)
        if any(abs(a - b) > TOLERANCE * max(a, b) for a, b in pairs):
            yield f"stands: {before}\n  now: {now}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    options = parser.parse_args(argv)
    text = document()
    if not options.check:
        FILE.write_text(text, encoding="utf-8")
        return 0
    stands = FILE.read_text(encoding="utf-8") if FILE.is_file() else ""
    found = list(differences(stands, text))
    for finding in found:
        print(f"{FILE.relative_to(ROOT)}: {finding}", file=sys.stderr)
    if found:
        print("if that is as it should be: make sizes-doc", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
