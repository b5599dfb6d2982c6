"""The README's C example is compiled and run, as a reader would: by the command that stands below it."""

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
README = ROOT / "README.md"
STRICT = " -Wall -Wextra -Wconversion -Wdouble-promotion -Werror "
EXAMPLE = re.compile(
    r"^```c\n(?P<code>.*?)^```\n\n    (?P<command>cc [^\n]*)\n    (?P<output>[^\n]*)$",
    re.MULTILINE | re.DOTALL,
)


def test_example_compiles_without_a_warning_and_prints_what_the_readme_says(tmp_path: Path) -> None:
    example = EXAMPLE.search(README.read_text(encoding="utf-8"))
    assert example, "README.md has no ```c block with its command and output below"
    (tmp_path / "main.c").write_text(example["code"], encoding="utf-8")
    (tmp_path / "firmware").symlink_to(ROOT / "firmware")
    command = example["command"].replace(" -std=c11 ", f" -std=c11{STRICT}").replace("$(find ", "$(find -L ")
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == example["output"]
