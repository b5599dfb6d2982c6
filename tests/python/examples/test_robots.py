"""examples/stm32, arduino and esp_idf: built for this computer and driven; the STM32's image in QEMU, too."""

import math
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from examples.building import EXAMPLES, FIRMWARE, ROOT, STRICT, STUBS, build_library, drive_end, run

STM32, ESP_IDF = EXAMPLES / "stm32", EXAMPLES / "esp_idf/main"
SKETCH = EXAMPLES / "arduino/bslam_robot/bslam_robot.ino"
Build = Callable[..., None]
DRIVE_S = 42.0  # of stubs/drive.h


def check_drive(printed: str, refused: int) -> None:
    """A robot's report of its drive: five tags, and where it is at the end of two and a half rounds."""
    poses = [line for line in printed.splitlines() if not line.startswith("tag ")]
    numbers = re.fullmatch(
        r"(-?\d+) mm, (-?\d+) mm, (-?\d+) mrad, (\d+) beacons, (\d+) refused(?: \(last: (.*)\))?", poses[-1]
    )
    assert numbers is not None, poses[-1]
    assert numbers[6] in (None, "not four whole numbers")
    x_mm, y_mm, mrad, beacons, refused_ones = map(int, numbers.groups()[:5])
    x_m, y_m, heading_rad = drive_end(DRIVE_S)
    # The left wheel slips by one part in a hundred: by odometry alone the heading would be 0.55 rad off.
    assert math.dist((1e-3 * x_mm, 1e-3 * y_mm), (x_m, y_m)) < 0.04
    assert abs(math.remainder(1e-3 * mrad - heading_rad, 2 * math.pi)) < 0.05
    assert (beacons, refused_ones) == (5, refused)
    assert len(poses) == pytest.approx(25 * DRIVE_S, rel=0.02)


def build_stm32(folder: Path, source: Path, library: Path, *flags: str) -> None:
    """From a copy elsewhere, or it would find its own board.h."""
    copy = folder / "main.c"
    copy.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    run(
        *("cc", "-std=gnu11", *STRICT, *flags, f"-I{STUBS / 'stm32'}", f"-I{FIRMWARE}"),
        *(copy, library, "-lm", "-o", "robot"),
        folder=folder,
    )


def build_arduino(folder: Path, source: Path, library: Path, *flags: str) -> None:
    stubs = STUBS / "arduino"
    run(
        *("g++", "-std=c++11", *STRICT, "-Wpedantic", f"-I{stubs}", f"-I{FIRMWARE}", "-include", "Arduino.h"),
        *(*flags, "-x", "c++", source, stubs / "core.cpp", "-x", "none", library, "-lm", "-o", "robot"),
        folder=folder,
    )


def build_esp_idf(folder: Path, source: Path, library: Path, *flags: str) -> None:
    stubs = STUBS / "esp_idf"
    run(
        *("cc", "-std=gnu11", *STRICT, *flags, f"-I{stubs}", f"-I{FIRMWARE}", source, stubs / "idf.c"),
        *(library, "-Wl,--wrap=bslam_sightings", "-lm", "-o", "robot"),
        folder=folder,
    )


def build_desktop(folder: Path, source: Path, library: Path, *flags: str) -> None:
    run(
        *("cc", "-std=c11", *STRICT, *flags, f"-I{FIRMWARE}", source, library, "-lm", "-o", "robot"),
        folder=folder,
    )


def test_stm32_drives(tmp_path: Path) -> None:
    cmake = (STM32 / "CMakeLists.txt").read_text(encoding="utf-8")
    sizes = re.findall(r"BSLAM_[A-Z_]+=\d+", cmake)
    assert len(sizes) == 4
    (tmp_path / "library").mkdir()
    library = build_library(tmp_path / "library", sizes)
    build_stm32(tmp_path, STM32 / "main.c", library, *(f"-D{size}" for size in sizes))
    check_drive(run("./robot", folder=tmp_path).stdout, refused=4)  # cut short, noise, two too long


def test_stm32_starts_in_qemu_and_maps_what_its_uart_tells(
    tmp_path: Path, sizes: dict[str, tuple[int, int]]
) -> None:
    """With wheels that stand: QEMU has no encoders."""
    board = (STM32 / "board.h").read_text(encoding="utf-8")
    standing, count = re.subn(r"return REGISTER\(TIMER_\w+ \+ 0x24\);", "return 7;", board)
    assert count == 2
    (tmp_path / "board.h").write_text(standing, encoding="utf-8")
    (tmp_path / "main.c").write_text((STM32 / "main.c").read_text(encoding="utf-8"), encoding="utf-8")
    defines = [f"-D{one}" for one in re.findall(r"BSLAM_[A-Z_]+=\d+", (STM32 / "CMakeLists.txt").read_text())]
    core = ("-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-Os")
    archive = STM32.parents[1] / "build/examples/stm32/bslam/libbslam.a"
    link = ("-T", STM32 / "stm32f411.ld", "-nostartfiles", "--specs=nano.specs", "--specs=nosys.specs")
    run(
        *("arm-none-eabi-gcc", *core, "-std=gnu11", *defines, f"-I{FIRMWARE}", "main.c", STM32 / "startup.s"),
        *(archive, *link, "-Wl,--gc-sections", "-lm", "-o", "robot.elf"),
        folder=tmp_path,
    )
    assert sizes["stm32"][0] < 512 * 1024
    assert _last_line_in_qemu(tmp_path / "robot.elf") == "0 mm, 0 mm, 0 mrad, 1 beacons, 1 refused"


def _last_line_in_qemu(image: Path) -> str:
    """After a tag 2 m ahead was told ten times, and noise once; USART2 is the second serial line.

    Its timers run 62 times too fast; instructions take 8 ns, so that the filter is in time all the same.
    """
    command = ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none"]
    command += ["-icount", "shift=3", "-serial", "null", "-serial", "stdio", "-kernel", str(image)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as qemu:
        assert qemu.stdin is not None and qemu.stdout is not None
        lines = ["0 7 0 2000\n"] * 10 + ["0 7 zero 2000\n"]
        deadline_s, line = time.monotonic() + 60, ""
        while time.monotonic() < deadline_s and not line.endswith(" 1 refused\n"):
            line = qemu.stdout.readline()
            if lines:
                qemu.stdin.write(lines.pop(0))
                qemu.stdin.flush()
        qemu.kill()
    return line.strip()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "-DCMAKE_TOOLCHAIN_FILE=../../firmware/cmake/cortex-m.cmake"),
        (
            [f"-DCMAKE_TOOLCHAIN_FILE={FIRMWARE}/cmake/cortex-m.cmake", "-DBSLAM_CORE=m0plus"],
            "BSLAM_CORE is m0plus; startup.s is for cores with a floating-point unit",
        ),
    ],
)
def test_stm32_is_not_configured_for_another_core(tmp_path: Path, words: list[str], says: str) -> None:
    said = run("cmake", "-S", STM32, "-B", tmp_path / "build", *words, folder=tmp_path, expect=1).stderr
    assert says in " ".join(said.split())


@pytest.mark.parametrize("board", [(), ("-DESP32",), ("-DESP32", "-DCONFIG_IDF_TARGET_ESP32C3=1")])
def test_arduino_sketch_drives(tmp_path: Path, library: Path, board: tuple[str, ...]) -> None:
    build_arduino(tmp_path, SKETCH, library, *board)
    check_drive(run("./robot", folder=tmp_path).stdout, refused=2)  # lines that are too long


def test_esp_idf_task_drives(tmp_path: Path, library: Path) -> None:
    """Its stub looks at the stamp of each picture, too."""
    build_esp_idf(tmp_path, ESP_IDF / "main.c", library)
    check_drive(run("./robot", folder=tmp_path).stdout, refused=2)  # lines that are too long


# By Espressif's data sheets: pins that are not there, read at the start (strapping), of flash and memory,
# of the console, of USB.
TAKEN = {
    "ESP32": {20, 24, *range(28, 32), *range(34, 40)} | {0, 2, 5, 12, 15} | {*range(6, 12), 16, 17} | {1, 3},
    "ESP32S2": {*range(22, 26), 46} | {0, 45} | set(range(26, 33)) | {43, 44} | {19, 20},
    "ESP32S3": set(range(22, 26)) | {0, 3, 45, 46} | set(range(26, 38)) | {43, 44} | {19, 20},
    "ESP32C3": {2, 8, 9} | set(range(11, 18)) | {20, 21} | {18, 19},
    "ESP32C6": {10, 11} | {4, 5, 8, 9, 15} | set(range(24, 31)) | {16, 17} | {12, 13},
}


@pytest.mark.parametrize("chip", TAKEN)
def test_pins_of_an_esp32_are_free(tmp_path: Path, chip: str) -> None:
    """ESP-IDF's example is for the first three: a C3 has no pulse counter, a C6 no such pins."""
    includes = (f"-I{STUBS / 'arduino'}", f"-I{FIRMWARE}")
    defines = ("-DESP32", f"-DCONFIG_IDF_TARGET_{chip}=1")
    texts = [run("g++", "-E", *includes, *defines, "-x", "c++", SKETCH, folder=tmp_path).stdout]
    if chip in ("ESP32", "ESP32S2", "ESP32S3"):
        texts.append((ESP_IDF / "main.c").read_text(encoding="utf-8"))
    for text in texts:
        pins = [int(pin) for pin in re.findall(r"(?:_A|_B|_RX) = (\d+)", text)]
        assert len(pins) == len(set(pins)) == 5
        assert not TAKEN[chip] & set(pins)


ROBOTS = [(build_arduino, SKETCH), (build_esp_idf, ESP_IDF / "main.c")]
NOT_FOUR = "not four whole numbers"


@pytest.mark.parametrize(("build", "source"), ROBOTS, ids=["arduino", "esp_idf"])
@pytest.mark.parametrize(
    ("said", "reason"),
    [
        ("40 9 100.5 2000", NOT_FOUR),
        ("40,9,0,2000", NOT_FOUR),
        ("40 9 0", NOT_FOUR),
        ("40 9 0 2000 1", NOT_FOUR),
        ("40 9 0 0", "BSLAM_E_RANGE"),
        ("740 9 0 2000", "BSLAM_E_TIME"),
        ("40 9 0 2000 \\r", "none"),
    ],
)
def test_what_is_refused_says_why(
    tmp_path: Path, library: Path, build: Build, source: Path, said: str, reason: str
) -> None:
    build(tmp_path, source, library, f'-DNOISE="{said}\\n"')
    *_, last = [line for line in run("./robot", folder=tmp_path).stdout.splitlines() if "mrad" in line]
    assert last.endswith(f"{int(reason != 'none')} refused (last: {reason})")


@pytest.mark.parametrize(("build", "source"), ROBOTS, ids=["arduino", "esp_idf"])
def test_the_first_metre_is_as_its_readme_has_it(
    tmp_path: Path, library: Path, build: Build, source: Path
) -> None:
    readme = (ROOT / "examples" / source.relative_to(EXAMPLES).parts[0] / "README.md").read_text("utf-8")
    (shown,) = re.findall(r"((?:    .*(?:mrad|tag).*\n)+)    \.\.\.\n((?:    .*\n)+)", readme)
    build(tmp_path, source, library, "-DDRIVE_METRE")
    lines = run("./robot", folder=tmp_path).stdout.splitlines()
    first_tag = next(number for number, line in enumerate(lines) if line.startswith("tag"))
    last_tag = max(number for number, line in enumerate(lines) if line.startswith("tag"))
    for block, number in zip(shown, (first_tag, last_tag), strict=True):
        for wanted, line in zip(block.splitlines(), lines[number - 1 : number + 1], strict=True):
            assert re.sub(r"-?\d+", "N", line) == re.sub(r"-?\d+", "N", wanted.strip())
            figures = [[int(one) for one in re.findall(r"-?\d+", text)] for text in (line, wanted)]
            assert figures[0] == pytest.approx(figures[1], abs=25)


@pytest.mark.parametrize("name", ["WHEELBASE_M", "WHEEL_RADIUS_M", "CAMERA_AHEAD_M"])
def test_a_measure_in_centimetres_does_not_compile(tmp_path: Path, name: str) -> None:
    text = re.sub(rf"({name} = [\d.]+)f", r"\1e2f", SKETCH.read_text(encoding="utf-8"))
    (tmp_path / "changed.cpp").write_text(text, encoding="utf-8")
    includes = (f"-I{STUBS / 'arduino'}", f"-I{FIRMWARE}", "-include", "Arduino.h")
    said = run("g++", "-std=c++11", *includes, "-c", "changed.cpp", folder=tmp_path, expect=1).stderr
    assert f"{name}: " in said and "in metres" in said


BEGINNERS = [
    (build_stm32, STM32 / "main.c", 2),
    (build_arduino, SKETCH, 2),
    (build_esp_idf, ESP_IDF / "main.c", 1),
    (build_desktop, EXAMPLES / "keep_the_map/keep_the_map.c", 1),
    (build_desktop, ROOT / "tests/sketches/drive.c", 1),
]
"""How it is built, its source, its exit status on this computer if the filter does not begin."""


@pytest.mark.parametrize(("build", "source", "status"), BEGINNERS, ids=lambda one: getattr(one, "name", ""))
def test_what_does_not_begin_says_why(
    tmp_path: Path, library: Path, build: Build, source: Path, status: int
) -> None:
    """Compiled with other sizes than the library; and with a setting outside its range, which has a name."""
    text = source.read_text(encoding="utf-8").replace(
        "bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);",
        "bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS); settings.gate_d2 = -1;",
    )
    changed = tmp_path / f"changed{source.suffix}"
    changed.write_text(text, encoding="utf-8")
    headers = '-DBSLAM_HEADER="bslam/bslam.h"'
    build(tmp_path, source, library, "-DBSLAM_BEACONS_MAX=6", headers)
    said = run("./robot", folder=tmp_path, expect=status).stdout
    assert "BSLAM_E_SIZE" in said and "gate_d2" not in said
    build(tmp_path, changed, library, headers)
    said = run("./robot", folder=tmp_path, expect=status).stdout
    assert "gate_d2" in said.split()[:2]


IDF = """
set(COMPONENT_LIB lib)
function(idf_component_register)
    cmake_parse_arguments(ONE "" "" "SRCS;INCLUDE_DIRS;REQUIRES" ${ARGN})
    message("${ONE_SRCS}|${ONE_INCLUDE_DIRS}|${ONE_REQUIRES}|${ONE_UNPARSED_ARGUMENTS}")
endfunction()
function(target_compile_definitions)
endfunction()
function(target_compile_options)
endfunction()
"""
"""What ESP-IDF's build has, for `cmake -P`."""


def test_the_esp_idf_component_says_that_it_was_copied_alone(tmp_path: Path) -> None:
    folder = tmp_path / "esp_idf/components/bslam"
    folder.mkdir(parents=True)
    cmake = (EXAMPLES / "esp_idf/components/bslam/CMakeLists.txt").read_text(encoding="utf-8")
    (folder / "CMakeLists.txt").write_text(f"{IDF}{cmake}", encoding="utf-8")
    said = " ".join(run("cmake", "-P", "CMakeLists.txt", folder=folder, expect=1).stderr.split())
    assert "has no bslam/bslam.h" in said and "bslam-esp-idf-*.tar.gz (make packages)" in said


@pytest.mark.parametrize("component", ["main", "components/bslam"])
def test_esp_idf_components_name_what_is_there(tmp_path: Path, component: str) -> None:
    folder = EXAMPLES / "esp_idf" / component
    script = tmp_path / "component.cmake"
    script.write_text(f'{IDF}\ninclude("{folder}/CMakeLists.txt")\n', encoding="utf-8")
    line = run("cmake", "-P", script, folder=tmp_path).stderr.strip()
    sources, includes, requires, more = line.split("|")
    assert more == ""
    if component == "main":
        assert (folder / sources).is_file() and "bslam" in requires.split(";")
    else:
        assert {Path(one).resolve() for one in sources.split(";")} == {
            path for part in ("base", "bslam") for path in (FIRMWARE / part).rglob("*.c")
        }
        assert (Path(includes) / "bslam/bslam.h").is_file()
