"""tools/checks/check_symbols.py reports what must not be in the firmware library."""

import subprocess
from pathlib import Path

import pytest

from tools.checks import check_symbols

CLEAN = """
static const float table[2] = {1.0f, 2.0f};
static int twice(int a) { return 2 * a; }
extern void *memcpy(void *, const void *, unsigned long);
float bslam_pick(int a, void *to) { memcpy(to, table, sizeof table); return table[twice(a) & 1]; }
"""


def archive(folder: Path, source: str) -> str:
    """The source as a host library; nothing is optimised away."""
    (folder / "part.c").write_text(source, encoding="utf-8")
    subprocess.run(["cc", "-std=c11", "-O0", "-c", "part.c"], cwd=folder, check=True)
    subprocess.run(["ar", "rcs", "libpart.a", "part.o"], cwd=folder, check=True)
    return str(folder / "libpart.a")


def test_main_clean_library_passes(tmp_path: Path) -> None:
    assert check_symbols.main([archive(tmp_path, CLEAN)]) == 0


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("int step(void) { return 1; }", "step is global and does not start with bslam_"),
        ("int bslam_count = 1;", "bslam_count is mutable static data"),
        ("int bslam_a(void) { static int calls; return calls++; }", "is mutable static data"),
        ("extern void *malloc(unsigned long); void *bslam_a(void) { return malloc(1); }", "malloc calls for"),
        (
            'extern int printf(const char *, ...); int bslam_a(int a) { return printf("%d", a); }',
            "printf calls for",
        ),
    ],
)
def test_main_bad_symbol_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], source: str, complaint: str
) -> None:
    assert check_symbols.main([archive(tmp_path, source)]) == 1
    error = capsys.readouterr().err
    assert complaint in error
    assert "part.o" in error
    assert len(error.splitlines()) == 1


DOUBLE_HELP = ["__aeabi_dmul", "__aeabi_f2d", "__aeabi_d2f", "__aeabi_cdcmple", "__muldf3", "__extendsfdf2"]


@pytest.mark.parametrize("name", [*DOUBLE_HELP, "_malloc_r", "_sbrk", "snprintf"])
def test_fault_unwanted_call_is_named(name: str) -> None:
    assert check_symbols.fault("U", name) is not None


@pytest.mark.parametrize("name", ["memcpy", "sqrtf", "__aeabi_fmul", "__aeabi_ldivmod", "__aeabi_uldivmod"])
def test_fault_call_of_float_or_integer_help_is_fine(name: str) -> None:
    assert check_symbols.fault("U", name) is None
