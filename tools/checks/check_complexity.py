"""Checks that no function is longer or more branched than a reader can hold in mind.

Exit status 0: all is well. 1: what is wrong, one finding a line.
"""

import argparse
import sys
from collections.abc import Iterator

import lizard

LINES_MAX = 60  # of code: neither blank nor comment
BRANCHES_MAX = 15  # cyclomatic complexity


def findings(paths: list[str]) -> Iterator[str]:
    """Every function beyond a limit in the C and Python files at or below `paths`."""
    files = lizard.get_all_source_files(paths, exclude_patterns=[], lans=["cpp", "python"])
    for file in lizard.analyze_files(files):
        for function in file.function_list:
            where = f"{file.filename}:{function.start_line}: {function.name}"
            if function.nloc > LINES_MAX:
                yield f"{where} has {function.nloc} lines of code; allowed: {LINES_MAX}"
            if function.cyclomatic_complexity > BRANCHES_MAX:
                branches = function.cyclomatic_complexity
                yield f"{where} has cyclomatic complexity {branches}; allowed: {BRANCHES_MAX}"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("paths", nargs="+", help="files or folders")
    found = list(findings(parser.parse_args(argv).paths))
    for finding in found:
        print(finding, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
