"""What `import bslam` gives."""

import subprocess
import sys
from importlib.metadata import version

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
