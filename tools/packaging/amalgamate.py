"""Writes the estimator as two files, bslam.h and bslam.c: base and bslam in one header and one source.

Every header stands once, behind those that it includes; then the sources. A name that is private to more than
one source gets its file's name in front, and a source's macros end with it.

Exit status 0: written. 2: something cannot be put into one file; nothing is written.
"""

import argparse
import re
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from tools.packaging.places import ROOT, PackagingError, tracked, write_files

HEADER = "bslam/bslam.h"
INCLUDE = re.compile(r'^#include "(.+)"\n', re.MULTILINE)
# What is at the left margin of a formatted source: functions, constants, types; macros.
DEFINED = re.compile(r"^(?!typedef\b|struct\b|union\b)\w[\w ]*[ *](\w+)(?:\[.*\])* *[(=;]", re.MULTILINE)
TYPE = re.compile(r"^(?:typedef )?(?:struct|union|enum) (\w+) \{$", re.MULTILINE)
ENUMERATION = re.compile(r"^(?:typedef )?enum(?: \w+)? \{(.*?)\}", re.MULTILINE | re.DOTALL)
MACRO = re.compile(r"^#define (\w+)", re.MULTILINE)
# Not every private function of a header is called; clang counts the headers in as its own.
START = """#ifdef __cplusplus
#error "bslam.c is C: compile it as C11"
#endif
#include "bslam.h"

#ifdef __clang__
#pragma clang diagnostic ignored "-Wunused-function"
#endif

"""
WORD_OR_TEXT = re.compile(r'"(?:\\.|[^"\\\n])*"|(?:\.|->)?\b[A-Za-z_]\w*')


def in_order(names: Iterable[str], texts: dict[str, str]) -> list[str]:
    """The headers, each behind those that it includes."""
    ordered: list[str] = []

    def visit(name: str, on_the_way: tuple[str, ...]) -> None:
        if name in on_the_way:
            raise PackagingError(f"headers include each other: {' '.join((*on_the_way, name))}")
        if name not in texts:
            raise PackagingError(f"{on_the_way[-1]} includes {name}, which git does not track")
        if name not in ordered:
            for included in INCLUDE.findall(texts[name]):
                visit(included, (*on_the_way, name))
            ordered.append(name)

    for name in names:
        visit(name, ())
    return ordered


def body(name: str, text: str) -> str:
    return f"// ---- {name} ".ljust(110, "-") + "\n\n" + INCLUDE.sub("", text).strip() + "\n\n"


def renamed(text: str, names: set[str], prefix: str) -> str:
    """With a prefix to these names, but in texts and where they are members."""
    return WORD_OR_TEXT.sub(lambda word: f"{prefix}_{word[0]}" if word[0] in names else word[0], text)


def names_in(source: str) -> set[str]:
    """What a source defines outside its functions, macros excepted."""
    enumerations = re.sub(r"//.*", "", ",".join(ENUMERATION.findall(source)))
    return {*DEFINED.findall(source), *TYPE.findall(source), *re.findall(r"(?:^|,)\s*(\w+)", enumerations)}


def amalgamate(texts: dict[str, str]) -> dict[str, str]:
    """ "bslam.h" and "bslam.c", of the sources and headers by their names in the include path."""
    headers = in_order((name for name in texts if name.endswith(".h")), texts)
    public = in_order([HEADER], texts)
    sources = [name for name in texts if name.endswith(".c")]
    defined = {name: names_in(texts[name]) for name in sources}
    owners = Counter(word for words in defined.values() for word in words)
    parts = [START, *(body(name, texts[name]) for name in headers if name not in public)]
    for name in sources:
        shared = {word for word in defined[name] if owners[word] > 1}
        ends = "".join(f"#undef {macro}\n" for macro in MACRO.findall(texts[name]))
        parts.append(renamed(body(name, texts[name]), shared, Path(name).stem) + ends)
    return {"bslam.h": "".join(body(name, texts[name]) for name in public), "bslam.c": "".join(parts)}


def amalgamated(root: Path) -> dict[str, bytes]:
    """Both files, each with the licence on top."""
    names = [name for name in tracked(root, "firmware/base", "firmware/bslam") if name.endswith((".c", ".h"))]
    texts = {name.removeprefix("firmware/"): (root / name).read_text(encoding="utf-8") for name in names}
    licence = (root / "LICENSE").read_text(encoding="utf-8").strip().splitlines()
    notice = "".join(f"// {line}".rstrip() + "\n" for line in licence) + "\n"
    return {name: (notice + text).encode() for name, text in amalgamate(texts).items()}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--root", type=Path, default=ROOT, help="the repository")
    parser.add_argument("--out", type=Path, default=Path("out/amalgamation"), help="the folder")
    options = parser.parse_args(argv)
    try:
        write_files(options.out, amalgamated(options.root))
    except (PackagingError, OSError) as error:
        print(f"amalgamate: {error}", file=sys.stderr)
        return 2
    print(f"{options.out}: bslam.h, bslam.c")
    return 0


if __name__ == "__main__":
    sys.exit(main())
