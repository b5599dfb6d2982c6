"""Prints how much RAM one instance takes, by compiler and number of beacons, with and without its members.

Nothing is run: the size of the struct is read from an object file, so that a cross-compiler does as well.
"""

import argparse
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

MEMBERS = {
    "as config.h has it": "",
    "BSLAM_RECOVERY = 0, BSLAM_GUARD = 0": " -DBSLAM_RECOVERY=0 -DBSLAM_GUARD=0",
    "BSLAM_APPEARANCE = 1": " -DBSLAM_APPEARANCE=1",
    "BSLAM_SMOOTHER = 1, BSLAM_RAYS_MAX = 0": " -DBSLAM_SMOOTHER=1 -DBSLAM_RAYS_MAX=0",
}
"""Flags of the compiler by what they say."""
PROBE = """#include "{}"
unsigned char bslam_size_probe[sizeof({})];
"""


def instance_bytes(
    compiler: str, nm: str, beacons_max: int, type_name: str = "bslam_t", header: str = "bslam/bslam.h"
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
    options = parser.parse_args(argv)
    for members, flags in MEMBERS.items():
        print_table(members, flags, options.beacons, options.compiler)
    return 0


def print_table(members: str, flags: str, beacons: list[int], compilers: list[list[str]]) -> None:
    """A row a map size, a column a compiler: its heading, command and nm."""
    print(f"RAM of one bslam_t, bytes, by BSLAM_BEACONS_MAX; {members}")
    print(f"{'beacons':>8}" + "".join(f"{name:>10}" for name, _, _ in compilers))
    for count in beacons:
        sizes = [instance_bytes(command + flags, nm, count) for _, command, nm in compilers]
        print(f"{count:>8}" + "".join(f"{size:>10}" for size in sizes))


if __name__ == "__main__":
    sys.exit(main())
