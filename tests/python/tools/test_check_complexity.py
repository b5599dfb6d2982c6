"""check_complexity.py reports functions that are too long or too branched, in C and in Python."""

from pathlib import Path

import pytest

from tools.checks import check_complexity


def c_function(statements: list[str]) -> str:
    return "int f(int a)\n{\n" + "".join(f"    {line}\n" for line in statements) + "    return a;\n}\n"


def python_function(statements: list[str]) -> str:
    return "def f(a):\n" + "".join(f"    {line}\n" for line in statements) + "    return a\n"


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("long.c", c_function(["a += 1;"] * 60), "lines of code; allowed: 60"),
        ("long.py", python_function(["a += 1"] * 60), "lines of code; allowed: 60"),
        ("branched.c", c_function(["if (a > 1) { a -= 1; }"] * 15), "complexity 16; allowed: 15"),
        ("branched.py", python_function(["a = a if a else 1"] * 15), "complexity 16; allowed: 15"),
    ],
)
def test_main_function_beyond_a_limit_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, complaint: str
) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert check_complexity.main([str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert f"{name}:1: f" in error
    assert complaint in error


def test_main_functions_at_the_limits_pass(tmp_path: Path) -> None:
    (tmp_path / "long.py").write_text(python_function(["a += 1"] * 58), encoding="utf-8")
    (tmp_path / "branched.c").write_text(c_function(["if (a > 1) { a -= 1; }"] * 14), encoding="utf-8")
    assert check_complexity.main([str(tmp_path)]) == 0
