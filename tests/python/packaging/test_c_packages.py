"""The C library's packages: each layout is whole, compiles as its ecosystem compiles it, and works.

The ecosystems' own tools are asked by `make check-packages`.
"""

import io
import json
import re
import shutil
import subprocess
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import kconfiglib
import pytest

from tools.packaging import amalgamate, packages, places

ROOT = Path(__file__).resolve().parents[3]
FIRMWARE = ROOT / "firmware"
SKETCHES = ROOT / "tests" / "sketches"
SOURCES = sorted(path for name in packages.LIBRARIES for path in (FIRMWARE / name).rglob("*.c"))
VERSION = json.loads((ROOT / "library.json").read_text(encoding="utf-8"))["version"]
CC = ("gcc", "-std=c11", "-ffp-contract=off")
ARM = ("arm-none-eabi-gcc", "-mcpu=cortex-m0plus", "-mthumb", "-std=gnu17")


def run(*command: object, folder: Path | None = None) -> str:
    """What the command prints; it must succeed."""
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
    return done.stdout


def unpack(packed: bytes, folder: Path) -> Path:
    """The content of a zip or tar.gz, in a new folder."""
    folder.mkdir()
    if packed.startswith(b"PK"):
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:
            archive.extractall(folder)
    else:
        subprocess.run(["tar", "-xzC", folder], input=packed, check=True)
    return folder


def objects_of(sources: Sequence[Path], folder: Path, *compiler: object) -> list[Path]:
    """Of all sources, in one place, each under its source's name alone."""
    folder.mkdir()
    run(*compiler, "-c", *sources, folder=folder)
    objects = sorted(folder.glob("*.o"))
    assert len(objects) == len(sources), "two sources have one name: an object is lost"
    return objects


def check_sketch(sketch: Path, *includes: str) -> None:
    """A sketch compiles that includes all headers as Arduino's sketches do."""
    text = "".join(f"#include <{header}>\n" for header in ("bslam.h", "bslam_vision.h", "bslam_link.h"))
    sketch.write_text(text + (SKETCHES / "estimator.cpp").read_text(encoding="utf-8"), encoding="utf-8")
    flags = ("-mcpu=cortex-m4", "-mthumb", "-std=gnu++11", "-Wall", "-Wextra", "-Wold-style-cast", "-Werror")
    run("arm-none-eabi-g++", "-fsyntax-only", *flags, *includes, sketch)


def symbols(archive: Path, nm: str = "nm") -> set[str]:
    """Functions and data that others may use."""
    lines = run(nm, "--defined-only", "--extern-only", archive).splitlines()
    return {line.split()[-1] for line in lines if len(line.split()) == 3}


@pytest.fixture(scope="module")
def packed() -> packages.Files:
    return packages.packages(ROOT)


def test_packages_are_of_tracked_files_and_the_same_again(packed: packages.Files) -> None:
    assert sorted(packed) == [
        f"bslam-amalgamation-{VERSION}.zip",
        f"bslam-arduino-{VERSION}.zip",
        f"bslam-esp-idf-{VERSION}.tar.gz",
        f"bslam-platformio-{VERSION}.tar.gz",
    ]
    assert packages.packages(ROOT) == packed


# ---- Arduino -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def arduino(packed: packages.Files, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library's folder, as Arduino unpacks it."""
    folder = tmp_path_factory.mktemp("arduino")
    return unpack(packed[f"bslam-arduino-{VERSION}.zip"], folder / "libraries") / "bslam"


def test_arduino_compiles_all_below_src_and_loses_nothing(arduino: Path, tmp_path: Path) -> None:
    sources = sorted((arduino / "src").rglob("*.c"))
    assert len(sources) == len(SOURCES)
    objects = objects_of(sources, tmp_path / "objects", *ARM, f"-I{arduino / 'src'}")
    run("arm-none-eabi-ar", "rcs", tmp_path / "library.a", *objects)
    found = symbols(tmp_path / "library.a", "arm-none-eabi-nm")
    assert {"bslam_init_sized", "bslam_vision_init_sized", "bslam_link_end"} <= found


def test_arduino_sketch_compiles_as_cxx_by_the_headers_that_arduino_finds(
    arduino: Path, tmp_path: Path
) -> None:
    check_sketch(tmp_path / "sketch.cpp", f"-I{arduino / 'src'}")


def test_arduino_sketches_include_what_arduino_finds(arduino: Path) -> None:
    own = {path.name for path in (arduino / "src").iterdir() if path.suffix == ".h"}
    sketches = list(arduino.glob("examples/*/*.ino"))
    assert sketches
    for sketch in sketches:
        assert sketch.stem == sketch.parent.name  # else Arduino does not open it
        included = re.findall(
            r'#include [<"](.*(?:bslam|vision|link).*)[>"]', sketch.read_text(encoding="utf-8")
        )
        assert included and set(included) <= own, f"{sketch.name}: only headers at the top of src are found"


def test_texts_of_the_arduino_archive_point_into_it(arduino: Path) -> None:
    pages = [path.relative_to(arduino).as_posix() for path in arduino.rglob("*.md")]
    assert pages == ["README.md"]
    text = (arduino / "README.md").read_text(encoding="utf-8")
    named = re.findall(r"src/[\w/.]+\.h|(?<=\]\()[^)]+", text)
    assert {"src/bslam/bslam.h", "src/bslam/config.h"} <= set(named)
    assert all((arduino / name).is_file() for name in named)


def test_arduino_properties_have_what_the_library_manager_asks_for(arduino: Path) -> None:
    lines = (arduino / "library.properties").read_text(encoding="utf-8").splitlines()
    properties = dict(line.split("=", 1) for line in lines)
    assert {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url",
            "architectures"} <= set(properties)  # fmt: skip
    assert (arduino / "src" / properties["includes"]).is_file()


# ---- PlatformIO --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def platformio(packed: packages.Files, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("platformio")
    return unpack(packed[f"bslam-platformio-{VERSION}.tar.gz"], folder / "bslam")


def test_platformio_manifest_names_what_the_package_holds(platformio: Path) -> None:
    manifest = json.loads((platformio / "library.json").read_text(encoding="utf-8"))
    build = manifest["build"]
    assert all((platformio / build["includeDir"] / header).is_file() for header in manifest["headers"])
    folders = [word[2:-2] for word in build["srcFilter"] if word.startswith("+<")]
    sources = [path for name in folders for path in (platformio / build["srcDir"] / name).rglob("*.c")]
    assert len(sources) == len(SOURCES)
    files = [path.relative_to(platformio) for path in platformio.rglob("*") if path.is_file()]
    exported = manifest["export"]["include"]
    assert all((platformio / name).exists() for name in exported)
    assert all(any(file.is_relative_to(name) for name in exported) for file in files)


def test_platformio_finds_the_headers_that_a_sketch_includes(platformio: Path, tmp_path: Path) -> None:
    build = json.loads((platformio / "library.json").read_text(encoding="utf-8"))["build"]
    flags = [flag[2:].strip() for flag in build["flags"] if flag.startswith("-I")]
    includes = [f"-I{platformio / name}" for name in (build["includeDir"], build["srcDir"], *flags)]
    check_sketch(tmp_path / "sketch.cpp", *includes)


# ---- ESP-IDF and Zephyr: their functions, as far as they are called ----------------------------------------

ESP_IDF = """cmake_minimum_required(VERSION 3.16)
project(idf LANGUAGES C)
set(ESP_PLATFORM 1)
set(COMPONENT_LIB __idf_bslam)
set(CONFIG_BSLAM_BEACONS_MAX 7)
function(idf_component_register)
    cmake_parse_arguments(C "" "" "SRCS;INCLUDE_DIRS" ${{ARGN}})
    add_library(${{COMPONENT_LIB}} STATIC ${{C_SRCS}})
    target_include_directories(${{COMPONENT_LIB}} PUBLIC ${{C_INCLUDE_DIRS}})
endfunction()
add_subdirectory({component} bslam)
add_executable(app {sketches}/drive.c)
target_compile_definitions(app PRIVATE BSLAM_HEADER="bslam/bslam.h")
target_link_libraries(app PRIVATE ${{COMPONENT_LIB}} m)
"""
ESP_IDF_FIRST_PASS = """set(ESP_PLATFORM 1)
macro(idf_component_register)
    cmake_parse_arguments(C "" "" "SRCS;INCLUDE_DIRS" ${{ARGN}})
    list(LENGTH C_SRCS count)
    message(STATUS "sources: ${{count}}")
    return()
endmacro()
include({component}/CMakeLists.txt)
"""
ZEPHYR = """cmake_minimum_required(VERSION 3.16)
project(zephyr LANGUAGES C)
set(CONFIG_BSLAM y)
set(CONFIG_BSLAM_BEACONS_MAX 7)
set(CONFIG_BSLAM_VISION_BUILT_IN 0)
set(CONFIG_BSLAM_VISION_TURNS 0)
add_library(zephyr_interface INTERFACE)
macro(zephyr_library_named name)
    set(zephyr_library ${{name}})
    add_library(${{name}} STATIC)
    target_link_libraries(${{name}} PUBLIC zephyr_interface)
endmacro()
macro(zephyr_library_sources)
    target_sources(${{zephyr_library}} PRIVATE ${{ARGN}})
endmacro()
macro(zephyr_library_compile_options)
    target_compile_options(${{zephyr_library}} PRIVATE ${{ARGN}})
endmacro()
macro(zephyr_include_directories)
    target_include_directories(zephyr_interface INTERFACE ${{ARGN}})
endmacro()
macro(zephyr_compile_definitions)
    target_compile_definitions(zephyr_interface INTERFACE ${{ARGN}})
endmacro()
add_subdirectory({component}/zephyr bslam)
add_executable(app {sketches}/drive.c)
target_compile_definitions(app PRIVATE BSLAM_HEADER="bslam/bslam.h")
target_link_libraries(app PRIVATE bslam zephyr_interface m)
"""


def build(project: str, folder: Path, component: Path, *words: str) -> Path:
    """Builds the project on this computer; its archive of the library."""
    (folder / "CMakeLists.txt").write_text(
        project.format(component=component, sketches=SKETCHES), encoding="utf-8"
    )
    run("cmake", "-S", folder, "-B", folder / "build", *words)
    run("cmake", "--build", folder / "build", "--parallel", 2)
    run(folder / "build" / "app", folder=folder)
    return next((folder / "build").rglob("lib*bslam.a"))


def test_esp_idf_registers_every_source_and_the_application_has_its_sizes(
    packed: packages.Files, tmp_path: Path
) -> None:
    component = unpack(packed[f"bslam-esp-idf-{VERSION}.tar.gz"], tmp_path / "bslam")
    (tmp_path / "first.cmake").write_text(ESP_IDF_FIRST_PASS.format(component=component), encoding="utf-8")
    assert f"sources: {len(SOURCES)}\n" in run("cmake", "-P", tmp_path / "first.cmake")
    archive = build(ESP_IDF, tmp_path, component)
    assert len(run("ar", "t", archive).split()) == len(SOURCES)
    assert {"bslam_init_sized", "bslam_vision_init_sized", "bslam_link_end"} <= symbols(archive)


def test_zephyr_builds_the_repository_as_a_module_without_what_is_switched_off(tmp_path: Path) -> None:
    module = (ROOT / "zephyr" / "module.yml").read_text(encoding="utf-8")
    assert re.search(r"^  cmake: zephyr$", module, re.MULTILINE)
    assert re.search(r"^  kconfig: zephyr/Kconfig$", module, re.MULTILINE)
    archive = build(ZEPHYR, tmp_path, ROOT, "-DCMAKE_C_FLAGS=-std=c99")  # what older ones compile with
    built_in = [path for path in SOURCES if "built_in" in path.parts]
    assert len(run("ar", "t", archive).split()) == len(SOURCES) - len(built_in)


def header_sizes() -> dict[str, str]:
    """What an application may set, and what the headers allow: "1 to 250"."""
    found = {}
    for folder in ("base", "bslam", "vision"):
        text = (FIRMWARE / folder / "config.h").read_text(encoding="utf-8").split("only the tests set")[0]
        messages = dict(re.findall(r'#error "(BSLAM_\w+) is (.*?)(?:, a multiple.*)?"', text))
        found |= {
            name: messages[name] for name in re.findall(r"^#ifndef (BSLAM_\w+(?<!_H))$", text, re.MULTILINE)
        }
    return found


def values_of(names: Iterable[str], folder: Path) -> dict[str, str]:
    """What the headers take by themselves."""
    probe = folder / "probe.c"
    values = "".join(f'printf("{name} %d\\n", {name});' for name in names)
    probe.write_text(
        '#include <stdio.h>\n#include "bslam/bslam.h"\n#include "vision/vision.h"\n'
        f"int main(void) {{ {values} }}\n",
        encoding="utf-8",
    )
    run(*CC, f"-I{FIRMWARE}", probe, "-o", folder / "probe")
    return dict(line.split() for line in run(folder / "probe").splitlines())


@pytest.mark.parametrize("menu", ["Kconfig", "zephyr/Kconfig"])
def test_menus_offer_the_sizes_of_the_headers(
    menu: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    config = kconfiglib.Kconfig(menu, warn=False)
    if "BSLAM" in config.syms:
        config.syms["BSLAM"].set_value(2)
    offered = {name: symbol for name, symbol in config.syms.items() if symbol.nodes and name != "BSLAM"}
    allowed = header_sizes()
    assert set(offered) == set(allowed)
    assert {name: symbol.str_value for name, symbol in offered.items()} == values_of(offered, tmp_path)
    for name, symbol in offered.items():
        low, high, _ = symbol.ranges[0]
        words = f"{low.name} to {high.name}"
        named = allowed[name].replace("0 or 1", "0 to 1").replace("0, 1 or 2", "0 to 2")
        assert words == named or name == "BSLAM_VISION_TURNS", name
    config.syms["BSLAM_BEACONS_MAX"].set_value("4")
    config.syms["BSLAM_APPEARANCE"].set_value("1")
    assert config.syms["BSLAM_RAYS_MAX"].str_value == "4"
    assert config.syms["BSLAM_HYPOTHESES_MAX"].str_value == "2"


# ---- the amalgamation --------------------------------------------------------------------------------------


def warnings(real: str) -> list[str]:
    """The project's own."""
    text = (ROOT / "mk" / "config.mk").read_text(encoding="utf-8").replace("\\\n", " ")
    names = ["C_WARNINGS", *(["C_WARNINGS_FLOAT"] if real == "float" else [])]
    return [
        word for name in names for word in re.findall(rf"^{name} := (.*)$", text, re.MULTILINE)[0].split()
    ]


@pytest.fixture(scope="module")
def two_files(packed: packages.Files, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("amalgamation")
    return unpack(packed[f"bslam-amalgamation-{VERSION}.zip"], folder / "bslam")


DRIVES = (("1", "0"), ("4", "1"), ("5", "1"))


@pytest.mark.parametrize("real", ["float", "double"])
def test_amalgamation_gives_the_same_bits(two_files: Path, tmp_path: Path, real: str) -> None:
    flags = (*CC, f"-DBSLAM_REAL_DOUBLE={int(real == 'double')}", "-DBSLAM_GUARD=2", "-DBSLAM_APPEARANCE=1")
    estimator = [path for path in SOURCES if path.relative_to(FIRMWARE).parts[0] in ("base", "bslam")]
    objects = objects_of(estimator, tmp_path / "objects", *flags, f"-I{FIRMWARE}")
    drive = (SKETCHES / "drive.c", "-lm", "-o")
    run(*flags, '-DBSLAM_HEADER="bslam/bslam.h"', f"-I{FIRMWARE}", *objects, *drive, tmp_path / "whole")
    strict = ("-O1", *warnings(real))
    run(*flags, *strict, "-c", two_files / "bslam.c", folder=tmp_path)
    run(*flags, '-DBSLAM_HEADER="bslam.h"', f"-I{two_files}", "bslam.o", *drive, tmp_path / "two",
        folder=tmp_path)  # fmt: skip
    printed = [run(tmp_path / "whole", *words) for words in DRIVES]
    assert [run(tmp_path / "two", *words) for words in DRIVES] == printed
    assert len({text.splitlines()[-1] for text in printed}) == len(DRIVES)


@pytest.mark.parametrize(
    "command",
    [
        ("clang-19", "-std=c11", "-Wall", "-Wextra", "-Werror", "-DBSLAM_SMOOTHER=1"),
        (
            "arm-none-eabi-gcc",
            "-std=c11",
            "-mcpu=cortex-m4",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-DBSLAM_RECOVERY=0",
            "-DBSLAM_GUARD=0",
        ),
    ],
)
def test_amalgamation_compiles_elsewhere(two_files: Path, command: Sequence[str]) -> None:
    run(*command, "-fsyntax-only", two_files / "bslam.c")


def test_amalgamation_has_one_header_for_cxx(two_files: Path, tmp_path: Path) -> None:
    text = (SKETCHES / "estimator.cpp").read_text(encoding="utf-8").replace("bslam/bslam.h", "bslam.h")
    (tmp_path / "sketch.cpp").write_text(text, encoding="utf-8")
    command = ("g++", "-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only")
    run(*command, f"-I{two_files}", tmp_path / "sketch.cpp")


def test_amalgamation_says_that_it_is_no_cxx(two_files: Path) -> None:
    words = ["g++", "-fsyntax-only", str(two_files / "bslam.c")]
    first = subprocess.run(words, capture_output=True, text=True).stderr.splitlines()[0]
    assert "bslam.c is C: compile it as C11" in first


def test_names_of_two_sources_are_told_apart_and_macros_end() -> None:
    start = '#include "bslam/bslam.h"\n'
    one = (
        "#define STEP 1\n\nstatic int step(void)\n{\n    return STEP;\n}\n\n"
        'int one(void)\n{\n    const char *text = "step";\n    return step() + text[0];\n}\n'
    )
    two = (
        "enum { STEP = 3 };\n\nstatic const int step[2] = {1, 2};\n\n"
        "int two(void)\n{\n    return step[1];\n}\n"
    )
    header = "int one(void);\nint two(void);\n"
    texts = {"bslam/bslam.h": header, "bslam/one.c": start + one, "bslam/two.c": start + two}
    source = amalgamate.amalgamate(texts)["bslam.c"]
    assert "return one_step() + text[0];" in source and '"step"' in source and "return two_step[1];" in source
    assert source.index("#undef STEP") < source.index("enum { STEP = 3 }")


def test_a_header_that_is_not_there_is_named() -> None:
    with pytest.raises(places.PackagingError, match=r"bslam/bslam.h includes base/lost.h"):
        amalgamate.amalgamate({"bslam/bslam.h": '#include "base/lost.h"\n'})


@pytest.mark.parametrize("taken", ["bslam.c", "."])
def test_what_cannot_be_written_is_one_line(
    taken: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    if taken == ".":
        out.touch()
    else:
        (out / taken).mkdir(parents=True)
    assert amalgamate.main(["--out", str(out)]) == 2
    assert re.fullmatch(r"amalgamate: .*out.*\n", capsys.readouterr().err)
    assert len(list(tmp_path.rglob("*"))) == (1 if taken == "." else 2)


def test_page_names_what_there_is(packed: packages.Files) -> None:
    page = (ROOT / "docs" / "PACKAGES.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\b(?:CONFIG_)?(BSLAM_\w+)", page)) - {
        "BSLAM_SIZES",
        "BSLAM_CORE",
        "BSLAM_CONFIG_HEADER",
    }
    assert named and named <= set(header_sizes())
    for pattern in re.findall(r"out/packages/([\w*.-]+)", page):
        assert any(Path(name).match(pattern) for name in packed), pattern
    for header in re.findall(r"<(bslam\w*\.h)>", page):
        assert (ROOT / packages.ARDUINO / "src" / header).is_file()
    targets = re.findall(
        r"^([\w-]+):", (ROOT / "mk" / "packages.mk").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert {"packages", "amalgamation", "check-packages"} <= set(re.findall(r"make ([\w-]+)", page)) & set(
        targets
    )


# ---- nothing half written ----------------------------------------------------------------------------------


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A copy of what packages are made of, under git."""
    copy = tmp_path / "repository"
    folders = (*packages.FOLDERS, "firmware/cmake", packages.ARDUINO, "examples/arduino", "examples/esp_idf")
    files = "library.json idf_component.yml CMakeLists.txt Kconfig firmware/Kconfig LICENSE README.md "
    files += "pyproject.toml CHANGELOG.md"
    for name in places.tracked(ROOT, *folders, *files.split()):
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)
    run("git", "-C", copy, "init", "--quiet")
    run("git", "-C", copy, "add", ".")
    return copy


def refused(repository: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What it says; nothing is written."""
    out.mkdir(parents=True)
    (out / "older").touch()
    assert packages.main(["--root", str(repository), "--out", str(out)]) == 2
    assert [path.name for path in out.parent.rglob("*")] == [out.name, "older"]
    return capsys.readouterr().err


def test_packages_leave_other_files_alone_and_leave_out_what_git_does_not_track(
    repository: Path, tmp_path: Path, packed: packages.Files
) -> None:
    (repository / "firmware/bslam/draft.c").write_text("int draft;\n", encoding="utf-8")
    out = tmp_path / "out" / "packages"
    out.mkdir(parents=True)
    (out / "older").touch()
    assert packages.main(["--root", str(repository), "--out", str(out)]) == 0
    assert sorted(path.name for path in out.parent.rglob("*")) == sorted([*packed, "older", "packages"])
    name = f"bslam-platformio-{VERSION}.tar.gz"
    assert (out / name).read_bytes() == packed[name]


def test_a_version_that_differs_stops_it(
    repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = repository / "library.json"
    path.write_text(path.read_text(encoding="utf-8").replace(VERSION, "9.9.9"), encoding="utf-8")
    said = refused(repository, tmp_path / "out" / "packages", capsys)
    assert (
        said
        == f"packages: versions differ: firmware/bslam/bslam.h has {VERSION}, but library.json has 9.9.9\n"
    )


def test_a_file_that_is_gone_stops_it(
    repository: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (repository / "firmware/link/frame.c").unlink()
    said = refused(repository, tmp_path / "out" / "packages", capsys)
    assert said == "packages: git tracks firmware/link/frame.c, which is not there\n"


def test_outside_git_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "no").mkdir()
    with pytest.raises(places.PackagingError, match="is no git repository; clone it with git: "):
        places.tracked(tmp_path / "no")
