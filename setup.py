"""The build of the package; pyproject.toml says all but its extensions."""

import sys
from pathlib import Path

import setuptools

sys.path.insert(0, str(Path(__file__).resolve().parent / "host_sim"))
from bslam_build import IS_ABI3, BuildExtensions, shipped

setuptools.setup(
    ext_modules=shipped(),
    cmdclass={"build_ext": BuildExtensions},
    options={"bdist_wheel": {"py_limited_api": "cp311"}} if IS_ABI3 else {},
)
