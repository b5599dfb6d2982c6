"""firmware/CMakeLists.txt: a program on this computer links the library, a core's library is clean; what it
installs is found by find_package and pkg-config, with its sizes.
"""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tools.checks import check_symbols, check_version

ROOT = Path(__file__).parents[3]
FIRMWARE = ROOT / "firmware"
SKETCHES = ROOT / "tests" / "sketches"


def cmake(*words):
    done = subprocess.run(["cmake", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


IN_A_HEADER = 'include_directories(.)\nadd_compile_definitions(BSLAM_CONFIG_HEADER="my_sizes.h")\n'


@pytest.mark.parametrize(
    ("sizes", "says"),
    [
        ("set(BSLAM_SIZES BSLAM_BEACONS_MAX=7 BSLAM_RAYS_MAX=0)\n", "BSLAM_BEACONS_MAX=7;BSLAM_RAYS_MAX=0"),
        (IN_A_HEADER, ""),
    ],
)
def test_a_program_links_the_library_with_the_sizes_it_sets(tmp_path, sizes, says):
    (tmp_path / "my_sizes.h").write_text("#define BSLAM_BEACONS_MAX 7\n#define BSLAM_RAYS_MAX 0\n")
    (tmp_path / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.16)\nproject(user LANGUAGES C)\n{sizes}"
        f"add_subdirectory({FIRMWARE} bslam)\nadd_executable(user main.c)\n"
        "target_link_libraries(user PRIVATE bslam::bslam)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "bslam/bslam.h"\nstatic bslam_t robot;\nint main(void)\n{\n'
        "    bslam_settings_t settings;\n    int bad_setting;\n"
        "    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);\n"
        "    const bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);\n"
        "    return status == BSLAM_OK && BSLAM_BEACONS_MAX == 7 ? 0 : 1;\n}\n"
    )
    said = cmake("-S", tmp_path, "-B", tmp_path / "build", "-DCMAKE_BUILD_TYPE=Debug")
    assert f"BSLAM_SIZES is '{says}'" in said
    cmake("--build", tmp_path / "build", "--target", "user")
    assert subprocess.run([tmp_path / "build" / "user"]).returncode == 0


def test_a_robot_of_its_own_kinds_leaves_the_built_in_ones_out(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user LANGUAGES C)\n"
        f"add_subdirectory({FIRMWARE} bslam)\nadd_executable(user main.c)\n"
        "target_link_libraries(user PRIVATE bslam::vision)\n"
        "target_compile_definitions(bslam_vision PUBLIC BSLAM_VISION_BUILT_IN=0)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "vision/vision.h"\nstatic bslam_vision_t eyes;\nint main(void)\n{\n'
        "    return bslam_vision_begin(&eyes, 0, BSLAM_PIXELS_RGB565, 320, 240) == BSLAM_OK;\n}\n"
    )
    cmake("-S", tmp_path, "-B", tmp_path / "build")
    cmake("--build", tmp_path / "build", "--target", "user")
    assert subprocess.run([tmp_path / "build" / "user"]).returncode == 0
    archive = next((tmp_path / "build").rglob("libbslam_vision.a"))
    members = subprocess.run(["ar", "t", archive], capture_output=True, text=True).stdout
    assert "scanner.c.o" in members and "front_end.c.o" not in members


def test_the_toolchain_file_builds_for_a_core(tmp_path):
    toolchain = FIRMWARE / "cmake" / "cortex-m.cmake"
    words = [f"-DCMAKE_TOOLCHAIN_FILE={toolchain}", "-DBSLAM_CORE=m0plus", "-DCMAKE_BUILD_TYPE=Debug"]
    cmake("-S", FIRMWARE, "-B", tmp_path, *words)
    cmake("--build", tmp_path)
    archive = tmp_path / "libbslam.a"
    archives = [str(archive), str(tmp_path / "libbslam_vision.a")]
    assert check_symbols.main([*archives, "--nm", "arm-none-eabi-nm"]) == 0
    shown = subprocess.run(["arm-none-eabi-readelf", "-A", archive], capture_output=True, text=True).stdout
    assert "Tag_CPU_arch: v6S-M" in shown


def test_the_toolchain_file_builds_cpp_for_the_same_core(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user CXX)\nadd_library(user user.cpp)\n"
    )
    (tmp_path / "user.cpp").write_text("float half(float x) { return x / 2; }\n")
    toolchain = FIRMWARE / "cmake" / "cortex-m.cmake"
    cmake("-S", tmp_path, "-B", tmp_path, f"-DCMAKE_TOOLCHAIN_FILE={toolchain}", "-DBSLAM_CORE=m4f")
    cmake("--build", tmp_path)
    words = ["arm-none-eabi-readelf", "-A", tmp_path / "libuser.a"]
    shown = subprocess.run(words, capture_output=True, text=True).stdout
    assert "Tag_ABI_VFP_args: VFP registers" in shown


def test_a_core_that_does_not_exist_is_refused_also_where_the_folder_stands_alone(tmp_path):
    alone = shutil.copytree(FIRMWARE / "cmake", tmp_path / "firmware" / "cmake")
    (tmp_path / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.16)\nproject(user C)\n")
    words = ["-S", tmp_path, f"-DCMAKE_TOOLCHAIN_FILE={alone / 'cortex-m.cmake'}"]
    assert "z80; allowed: m0plus, m4f, m7, m33, m55" in refused(
        *words, "-B", tmp_path / "z", "-DBSLAM_CORE=z80"
    )
    cmake(*words, "-B", tmp_path / "m55", "-DBSLAM_CORE=m55")


# ---- sizes and flags ---------------------------------------------------------------------------------------


def refused(*words):
    done = subprocess.run(["cmake", *map(str, words)], capture_output=True, text=True)
    assert done.returncode != 0
    return " ".join(done.stderr.split())


NO_SIZES = ["BSLAM_BEACON_MAX=7", "BSLAM_BEACONS_MAX", "BSLAM_BEACONS_MAX=many", "7"]
NOT_SEPARATED = ["BSLAM_BEACONS_MAX=50 BSLAM_GUARD=0", "BSLAM_BEACONS_MAX=50,BSLAM_GUARD=0"]


@pytest.mark.parametrize("size", [*NO_SIZES, *NOT_SEPARATED])
def test_a_size_that_does_not_exist_is_refused(tmp_path, size):
    said = refused("-S", FIRMWARE, "-B", tmp_path, f"-DBSLAM_SIZES=BSLAM_RAYS_MAX=0;{size}")
    assert f"BSLAM_SIZES has '{size}'" in said and "BSLAM_BEACONS_MAX, " in said
    assert "separated by semicolons" in said


def options_of(folder, *words):
    """The words of the command that compiles bslam.c, and what CMake printed."""
    said = cmake("-S", FIRMWARE, "-B", folder, "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", *words)
    units = json.loads((folder / "compile_commands.json").read_text())
    return next(unit["command"] for unit in units if unit["file"].endswith("bslam/bslam.c")).split(), said


@pytest.mark.parametrize("words", [["-DCMAKE_BUILD_TYPE=Debug"], ["-DCMAKE_C_FLAGS=-O2"]])
def test_what_the_user_chooses_is_not_overruled(tmp_path, words):
    options, said = options_of(tmp_path, *words)
    assert "-Os" not in options and "-Os" not in said


def test_without_a_build_type_it_is_small_and_says_so_once(tmp_path):
    options, said = options_of(tmp_path)
    assert "-Os" in options and "-ffp-contract=off" in options
    assert said.count("-Os") == 1


def test_fetch_content_takes_the_folder(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.18)\nproject(user LANGUAGES C)\ninclude(FetchContent)\n"
        f"FetchContent_Declare(bslam SOURCE_DIR {ROOT} SOURCE_SUBDIR firmware)\n"
        "FetchContent_MakeAvailable(bslam)\nadd_executable(user main.c)\n"
        "target_link_libraries(user PRIVATE bslam::link)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "link/crc16.h"\nint main(void)\n{\n'
        "    return bslam_crc16_add(0, 0x31) == 0x2672 ? 0 : 1;\n}\n"
    )
    cmake("-S", tmp_path, "-B", tmp_path / "build")
    cmake("--build", tmp_path / "build")
    assert [path.name for path in tmp_path.rglob("*.a")] == ["libbslam_link.a"]  # only what is linked
    assert subprocess.run([tmp_path / "build" / "user"]).returncode == 0
    cmake("--install", tmp_path / "build", "--prefix", tmp_path / "installed")
    assert not (tmp_path / "installed").exists()  # only what the user installs


# ---- what is installed -------------------------------------------------------------------------------------

USER = """cmake_minimum_required(VERSION 3.16)
project(user LANGUAGES C CXX)
find_package(bslam {version} CONFIG REQUIRED COMPONENTS bslam vision link)
add_executable(same same.cpp)
target_link_libraries(same PRIVATE bslam::bslam bslam::vision bslam::link)
add_executable(other {sketches}/other_sizes.c)
target_link_libraries(other PRIVATE bslam::bslam)
target_compile_options(other PRIVATE -UBSLAM_BEACONS_MAX -DBSLAM_BEACONS_MAX=9)
"""
SAME = """#include "bslam/bslam.h"
#include "link/parser.h"
#include "vision/vision.h"
static bslam_t robot;
static bslam_vision_t eyes;
int main()
{
    bslam_settings_t settings;
    int bad_setting = 0;
    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);
    (void)bslam_vision_begin(&eyes, 0, BSLAM_PIXELS_RGB565, 32, 32);
    return bslam_init(&robot, &settings, &bad_setting) == BSLAM_OK && BSLAM_BEACONS_MAX == 7 ? 0 : 1;
}
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Built with room for 7 beacons and installed from the top of the repository, then moved."""
    folder = tmp_path_factory.mktemp("installed")
    words = ["-DBSLAM_SIZES=BSLAM_BEACONS_MAX=7;BSLAM_RAYS_MAX=0", "-DCMAKE_C_FLAGS=-O0"]
    cmake("-S", ROOT, "-B", folder / "build", *words)
    cmake("--build", folder / "build", "--parallel", 2)
    cmake("--install", folder / "build", "--prefix", folder / "first")
    shutil.rmtree(folder / "build")
    return (folder / "first").rename(folder / "second")


def version():
    return check_version.version(ROOT / "pyproject.toml", "pyproject.toml")


def test_find_package_brings_the_sizes_and_other_sizes_are_refused(tmp_path, installed):
    (tmp_path / "CMakeLists.txt").write_text(USER.format(version=version(), sketches=SKETCHES))
    (tmp_path / "same.cpp").write_text(SAME)
    sizes = "BSLAM_RAYS_MAX=0;BSLAM_BEACONS_MAX=7"
    words = [f"-DCMAKE_PREFIX_PATH={installed}", f"-DBSLAM_SIZES={sizes}"]
    said = cmake("-S", tmp_path, "-B", tmp_path / "build", *words)
    assert "installed with BSLAM_SIZES 'BSLAM_BEACONS_MAX=7;BSLAM_RAYS_MAX=0'" in said
    cmake("--build", tmp_path / "build")
    assert subprocess.run([tmp_path / "build" / "same"]).returncode == 0
    said = subprocess.run([tmp_path / "build" / "other"], capture_output=True, text=True)
    assert said.returncode == 0 and said.stdout.startswith("BSLAM_E_SIZE, 0 bytes")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("99.0 CONFIG REQUIRED", f"bslamConfig.cmake, version: {version()}"),
        ("0.1 CONFIG REQUIRED", f"bslamConfig.cmake, version: {version()}"),
        ("CONFIG REQUIRED COMPONENTS eyes", "no component 'eyes'; allowed: bslam, vision, link"),
        (
            "CONFIG REQUIRED)\nset(BSLAM_SIZES BSLAM_BEACONS_MAX=8)\nfind_package(bslam CONFIG REQUIRED",
            "'BSLAM_BEACONS_MAX=8', but bslam was installed with 'BSLAM_BEACONS_MAX=7;BSLAM_RAYS_MAX=0'",
        ),
    ],
)
def test_find_package_refuses_what_is_not_installed(tmp_path, installed, asked, said):
    (tmp_path / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.16)\nproject(user LANGUAGES C)\nfind_package(bslam {asked})\n"
    )
    assert said in refused("-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={installed}")


def test_pkg_config_finds_what_was_moved(tmp_path, installed):
    def told(*words):
        command = ["pkg-config", *words, "bslam", "bslam-vision", "bslam-link"]
        where = {"PKG_CONFIG_PATH": str(next(installed.rglob("pkgconfig")))}
        return subprocess.run(command, check=True, capture_output=True, text=True, env=where).stdout.split()

    assert told("--modversion") == 3 * [version()]
    (tmp_path / "same.cpp").write_text(SAME)
    command = ["g++", *told("--cflags"), "same.cpp", *told("--libs"), "-o", "same"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "same"]).returncode == 0
