"""Checks the symbols of cross-compiled libraries, as nm lists them.

Every global name starts with bslam_, so that the library can be linked with anything. No mutable static data,
so that several instances can live side by side. No call of heap, printf or double arithmetic: they cost a
microcontroller dearly.

Exit status 0: all is well. 1: what is wrong, one finding a line.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator

PREFIX = "bslam_"
# .data, .bss, small data and common, global or static.
MUTABLE_TYPES = frozenset("DdBbGgSsC")
UNDEFINED_TYPES = frozenset("Uwv")
UNWANTED_CALLS = re.compile(
    r"""
    __aeabi_(d|cd|f2d|i2d|ui2d|l2d|ul2d)    # double arithmetic by library calls; so are GCC's own names:
    | __(?!ieee754_|math_)\w+df[23]?$
    | _?(m|c|re)alloc(_r)?$ | free$ | _sbrk$
    | (v?s?n?|f)printf$ | puts$ | putchar$
    """,
    re.VERBOSE,
)


def fault(kind: str, name: str) -> str | None:
    """What is wrong with a symbol of nm's type letter `kind`, or None."""
    if kind in UNDEFINED_TYPES:
        return "calls for heap, printf or double arithmetic" if UNWANTED_CALLS.match(name) else None
    if kind in MUTABLE_TYPES:
        return "is mutable static data"
    if kind.isupper() and not name.startswith(PREFIX):
        return f"is global and does not start with {PREFIX}"
    return None


def findings(listing: str) -> Iterator[str]:
    """Every bad symbol in the output of `nm --portability ARCHIVE...`."""
    member = ""
    for line in listing.splitlines():
        if line.endswith(":"):
            member = line.rstrip(":")
            continue
        name, kind = line.split()[:2]
        trouble = fault(kind, name)
        if trouble:
            yield f"{member}: {name} {trouble}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("archives", nargs="+", metavar="ARCHIVE", help="libbslam.a, libvision.a, ...")
    parser.add_argument("--nm", default="nm", help="the nm of the toolchain that made it (default: nm)")
    options = parser.parse_args(argv)
    command = [options.nm, "--portability", *options.archives]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = list(findings(listing))
    for finding in found:
        print(finding, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
