"""firmware/CMakeLists.txt: a program on this computer links the library, a core's library is clean."""

import subprocess
from pathlib import Path

from tools.checks import check_symbols

FIRMWARE = Path(__file__).parents[3] / "firmware"


def cmake(*words):
    done = subprocess.run(["cmake", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_program_links_the_library(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user LANGUAGES C)\n"
        f"add_subdirectory({FIRMWARE} bslam)\nadd_executable(user main.c)\n"
        "target_link_libraries(user PRIVATE bslam::bslam)\n"
        "target_compile_definitions(bslam PUBLIC BSLAM_BEACONS_MAX=7)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "bslam/bslam.h"\nstatic bslam_t robot;\nint main(void)\n{\n'
        "    bslam_settings_t settings;\n    int bad_setting;\n"
        "    bslam_settings_preset(&settings, BSLAM_PRESET_REAL_WHEELS);\n"
        "    const bslam_status_t status = bslam_init(&robot, &settings, &bad_setting);\n"
        "    return status == BSLAM_OK && BSLAM_BEACONS_MAX == 7 ? 0 : 1;\n}\n"
    )
    cmake("-S", tmp_path, "-B", tmp_path / "build")
    cmake("--build", tmp_path / "build", "--target", "user")
    assert subprocess.run([tmp_path / "build" / "user"]).returncode == 0


def test_a_robot_of_its_own_kinds_leaves_the_built_in_ones_out(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user LANGUAGES C)\n"
        f"add_subdirectory({FIRMWARE} bslam)\nadd_executable(user main.c)\n"
        "target_link_libraries(user PRIVATE bslam::vision)\n"
        "target_compile_definitions(vision PUBLIC BSLAM_VISION_BUILT_IN=0)\n"
    )
    (tmp_path / "main.c").write_text(
        '#include "vision/vision.h"\nstatic bslam_vision_t eyes;\nint main(void)\n{\n'
        "    return bslam_vision_begin(&eyes, 0, BSLAM_PIXELS_RGB565, 320, 240) == BSLAM_OK;\n}\n"
    )
    cmake("-S", tmp_path, "-B", tmp_path / "build")
    cmake("--build", tmp_path / "build", "--target", "user")
    assert subprocess.run([tmp_path / "build" / "user"]).returncode == 0
    archive = next((tmp_path / "build").rglob("libvision.a"))
    members = subprocess.run(["ar", "t", archive], capture_output=True, text=True).stdout
    assert "scanner.c.o" in members and "front_end.c.o" not in members


def test_the_toolchain_file_builds_for_a_core(tmp_path):
    toolchain = FIRMWARE / "cmake" / "cortex-m.cmake"
    words = [f"-DCMAKE_TOOLCHAIN_FILE={toolchain}", "-DBSLAM_CORE=m0plus", "-DCMAKE_BUILD_TYPE=MinSizeRel"]
    cmake("-S", FIRMWARE, "-B", tmp_path, *words)
    cmake("--build", tmp_path)
    archive = tmp_path / "libbslam.a"
    archives = [str(archive), str(tmp_path / "libvision.a")]
    assert check_symbols.main([*archives, "--nm", "arm-none-eabi-nm"]) == 0
    shown = subprocess.run(["arm-none-eabi-readelf", "-A", archive], capture_output=True, text=True).stdout
    assert "Tag_CPU_arch: v6S-M" in shown


def test_a_core_that_does_not_exist_is_refused(tmp_path):
    toolchain = FIRMWARE / "cmake" / "cortex-m.cmake"
    words = [
        "cmake",
        "-S",
        FIRMWARE,
        "-B",
        tmp_path,
        f"-DCMAKE_TOOLCHAIN_FILE={toolchain}",
        "-DBSLAM_CORE=z80",
    ]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode != 0
    assert "allowed: m0plus, m4f, m7, m33" in done.stderr
