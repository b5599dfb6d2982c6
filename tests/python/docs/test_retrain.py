"""docs/RETRAIN.md: its C compiles with a user's header, its table of labels is what training reads."""

import os
import re
import subprocess
from pathlib import Path

from PIL import Image

from bslam.cheader import scanner_header, write_header
from bslam.core.scanner import NOTHING
from bslam.datasets.labels import COLUMNS, FILE, read_folder
from bslam.modelfile import BeaconClass
from bslam.scannerfile import ScannerModel

ROOT = Path(__file__).resolve().parents[3]
TEXT = (ROOT / "docs/RETRAIN.md").read_text(encoding="utf-8")


def test_example_compiles_with_a_generated_header(tmp_path):
    model = ScannerModel(NOTHING.kinds, NOTHING.windows, {})
    write_header(tmp_path / "models/my_things.h", scanner_header(model, "my_things"))
    (code,) = re.findall(r"```c\n(.*?)```", TEXT, re.DOTALL)
    (tmp_path / "main.c").write_text(re.sub(r"^int ", "static int ", code, flags=re.MULTILINE))
    flags = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-Wno-unused-function"]
    command = [os.environ.get("CC", "cc"), *flags, f"-I{ROOT / 'firmware'}", f"-I{tmp_path}"]
    built = subprocess.run(
        [*command, "-c", str(tmp_path / "main.c"), "-o", str(tmp_path / "main.o")],
        check=False,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stderr


def test_table_of_labels_is_read_by_the_training(tmp_path):
    (table,) = re.findall(r"^    (picture,.*\n(?:    .*\n)+)", TEXT, re.MULTILINE)
    lines = [line.strip() for line in table.splitlines()]
    assert lines[0] == ",".join(COLUMNS)
    for line in lines[1:]:
        Image.new("RGB", (1280, 960)).save(tmp_path / line.split(",")[0])
    (tmp_path / FILE).write_text("\n".join(lines) + "\n")
    folder = read_folder(tmp_path)
    assert folder.objects == (BeaconClass("red box", 0.3, 0.1),)
    assert [len(picture.labels) for picture in folder.pictures] == [1, 0]
