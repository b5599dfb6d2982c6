"""Prints how much RAM one SLAM instance and one learner take, by compiler and number of beacons.

Nothing is run: the size of the struct is read from an object file, so that a cross-compiler does as well.
"""

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

PROBE = """#include "{}"
unsigned char bslam_size_probe[sizeof({})];
"""


def instance_bytes(
    compiler: str, nm: str, beacons_max: int, type_name: str, header: str = "bslam/bslam.h"
) -> int:
    """sizeof(type_name) for a map of `beacons_max`; `compiler` is a command with its flags."""
    with tempfile.TemporaryDirectory() as folder:
        probe = Path(folder) / "probe.o"
        source = PROBE.format(header, type_name)
        compile_probe = f"{compiler} -DBSLAM_BEACONS_MAX={beacons_max} -xc - -c -o {shlex.quote(str(probe))}"
        subprocess.run(shlex.split(compile_probe), input=source, check=True, text=True)
        list_symbols = [nm, "--portability", str(probe)]
        listing = subprocess.run(list_symbols, check=True, capture_output=True, text=True).stdout
    _name, _kind, _address, size = listing.split()
    return int(size, 16)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beacons", type=int, nargs="+", required=True, help="map sizes")
    parser.add_argument(
        "--compiler",
        nargs=3,
        action="append",
        required=True,
        metavar=("NAME", "COMMAND", "NM"),
        help="a column: its heading, the compiler with its flags, the nm that goes with it",
    )
    parser.add_argument("--learner", type=int, nargs="+", default=[], help="map sizes, for the learner")
    options = parser.parse_args(argv)
    print_table("RAM of one instance, bytes", "bslam_slam_t", options.beacons, options.compiler)
    if options.learner:
        print_table("RAM of one learner, bytes", "bslam_learner_t", options.learner, options.compiler)
    return 0


def print_table(title: str, type_name: str, beacons: list[int], compilers: list[list[str]]) -> None:
    """A row a map size, a column a compiler: its heading, command and nm."""
    print(f"{title} (BSLAM_BEACONS_MAX = number of beacons)")
    print(f"{'beacons':>8}" + "".join(f"{name:>10}" for name, _, _ in compilers))
    for count in beacons:
        sizes = [instance_bytes(command, nm, count, type_name) for _, command, nm in compilers]
        print(f"{count:>8}" + "".join(f"{size:>10}" for size in sizes))


if __name__ == "__main__":
    sys.exit(main())
