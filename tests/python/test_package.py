"""What `import bslam` gives."""

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import bslam


def test_the_package_offers_slam_and_its_version():
    from bslam import Slam

    assert Slam().pose() == (0.0, 0.0, 0.0)
    assert bslam.__version__ == version("bslam")
    with pytest.raises(AttributeError, match="no attribute 'Slem'"):
        bslam.Slem  # noqa: B018


def test_import_alone_loads_neither_numpy_nor_the_library():
    text = "import sys, bslam; assert not {'numpy', 'bslam.core'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", text], check=True)


def test_no_message_names_a_pip_of_another_python():
    """`pip_install` names the Python that runs."""
    for path in Path(bslam.__file__).parent.rglob("*.py"):
        assert not re.search("""(?:allowed: |: |["'])pip install""", path.read_text(encoding="utf-8")), path
