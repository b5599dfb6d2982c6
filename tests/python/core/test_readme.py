"""The README's C example is compiled and run, as a reader would."""

import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
README = ROOT / "README.md"
STRICT = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror"]
EXAMPLE = re.compile(r"^```c\n(?P<code>.*?)^```\n(?P<below>(?:\n|    .*\n)*)", re.MULTILINE | re.DOTALL)


def test_example_compiles_without_a_warning_and_prints_what_the_readme_says(tmp_path: Path) -> None:
    example = EXAMPLE.search(README.read_text(encoding="utf-8"))
    assert example, "README.md has no ```c block"
    source, program = tmp_path / "main.c", tmp_path / "main"
    source.write_text(example["code"], encoding="utf-8")
    library = map(str, sorted((ROOT / "firmware" / "bslam").rglob("*.c")))
    command = [os.environ.get("CC", "cc"), *STRICT, f"-I{ROOT / 'firmware'}", str(source), *library]
    built = subprocess.run([*command, "-lm", "-o", str(program)], check=False, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    result = subprocess.run([program], check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout
    # Below the example stand the command and what it prints.
    assert result.stdout.strip() in example["below"]
