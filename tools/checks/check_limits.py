"""Prints how large the project is beside limits.toml, and finds words that the field has another word for.

Exit status 0: no figure is above its limit. 1: what is, and where each word stands too often.
"""

import argparse
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

TABLE = Path(__file__).with_name("limits.toml")
PUBLIC_HEADERS = ("bslam/bslam.h", "vision/vision.h")
# What a user reads of what they include, and the texts of the settings.
READ_HEADERS = (
    *("base/config.h", "base/status.h", "base/types.h", "bslam/config.h", "bslam/settings.h"),
    *("bslam/association/tuning.h", "vision/config.h"),
)
LONG_SENTENCE = 35

# The word that a reader of the field looks for, and ours for it where it can be told from common English.
WORDS = {
    "appearance": r"(by|the|its|their|what|of|and|once|no) looks(?! (like|at|for)\b)|looks (count|speak)",
    "classifier": r"(?<!\bvector )(?<!\b(?:this|your|time) )(?<!\bone )(?<!` )(?<!-like )(?<!\bstate )"
    r"(?<!\bevery )(?<!\banother )machines?(?!'s byte| learning)",
    "known data association": r"told(?! apart)",
    "trained": r"taught",
    "bearing-only": r"directions? only",
    "relative to known association": r"against known",
    "descriptor distance": r"unlike|apartness",
    "viewpoint": r"outlooks?",
    "missed beacon": r"vanish(ed|es)?",
    "duplicates": r"(the|two|are|its|no) doubles",
    "tentative": r"on trial",
    "existence evidence": r"trust",
    "competitor, negative sample": r"rivals?",
    "distance travelled": r"grows with the way",
    "pre-filter": r"glances?",
    "vertical edges": r"uprights",
    "box refinement": r"snap(s|ped)?",
    "side face, orientation": r"flanks?|stances?",
    "kidnapped": r"(was|is|be) carried(?! (on|out|through|there|over)\b)",
    "double-precision build": r"twins?",
    "noise realisation": r"draws of",
    "(no such figure)": r"by hand",
}


# ---- what is counted ---------------------------------------------------------------------------------------


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def code_lines(text: str) -> int:
    """Lines of C that are neither blank nor comment alone."""
    without = re.sub(r"/\*.*?\*/", lambda comment: "\n" * comment[0].count("\n"), text, flags=re.DOTALL)
    return sum(1 for line in without.splitlines() if line.split("//")[0].strip())


def library_figures(root: Path) -> Iterator[tuple[str, float]]:
    libraries = {"estimator with base": ("base", "bslam"), "vision": ("vision",), "link": ("link",)}
    for name, folders in (libraries | {"robot": ("robot",)}).items():
        texts = [text_of(path) for folder in folders for path in (root / "firmware" / folder).rglob("*.[ch]")]
        yield f"{name}: lines", sum(len(text.splitlines()) for text in texts)
        yield f"{name}: lines of code", sum(code_lines(text) for text in texts)


def declared_functions(preprocessed: str, own: str) -> list[str]:
    """Functions that preprocessed C declares in files whose path has `own` in it."""
    kept, is_own = [], False
    for line in preprocessed.splitlines():
        if match := re.match(r'# \d+ "(.*?)"', line):
            is_own = own in match[1]
        elif is_own:
            kept.append(line)
    text = "\n".join(kept)
    while "{" in text:  # structs, and bodies of inline functions
        text, count = re.subn(r"\{[^{}]*\}", ";", text)
        if count == 0:
            break
    text = re.sub(r"__attribute__\s*\(\(.*?\)\)|\btypedef\b[^;]*;", "", text)
    return re.findall(r"(?:^|;)[^;()]*?\b(\w+)\s*\([^;]*\)\s*(?=;)", text)


def header_figures(root: Path) -> Iterator[tuple[str, float]]:
    for name in PUBLIC_HEADERS:
        command = ["cc", "-std=c11", "-E", f"-I{root / 'firmware'}", str(root / "firmware" / name)]
        preprocessed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        yield f"{name}: lines", len(text_of(root / "firmware" / name).splitlines())
        functions = declared_functions(preprocessed, "firmware/")
        yield f"{name}: functions, with what it includes", len(functions)


def table_rows(text: str, macro: str) -> int:
    """Lines of a table of settings."""
    table = re.search(rf"#define {macro}\(.*?(?:[^\\])$", text, re.DOTALL | re.MULTILINE)
    return (
        len(re.findall(r"\b(?:REAL|INTEGER)\(\w+,(?! INTEGER)", table[0].split("\n", 1)[1])) if table else 0
    )


def sizes_of(root: Path, library: str) -> list[str]:
    """Macros that an application may define for a library, but for those that only tests do."""
    found = []
    for folder in ("base", library):
        for path in sorted((root / "firmware" / folder).rglob("*.h")):
            text = text_of(path).split("only the tests set them")[0]
            found += re.findall(r"^#ifndef (\w+)\n#define \1 \S", text, re.MULTILINE)
    return found


def setting_figures(root: Path) -> Iterator[tuple[str, float]]:
    text = text_of(root / "firmware/bslam/settings.h")
    yield "settings", table_rows(text, "BSLAM_SETTINGS")
    yield "settings, expert", table_rows(text, "BSLAM_EXPERT")
    for library in ("bslam", "vision", "link"):
        yield f"compile-time sizes: {library}", len(sizes_of(root, library))


def sentences(markdown: str) -> Iterator[str]:
    """Sentences of running text: no code, table, heading or picture. An item of a list begins a new one."""
    text = re.sub(r"^```.*?^```$|<!--.*?-->|\$\$.*?\$\$", "\n\n", markdown, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^(#|\||!\[).*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`|\$[^$]*\$", "x", text)
    for block in re.split(r"\n\s*\n|\n\s*(?=[-*] |\d+\. )", text):
        for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z*\"(\[x])", " ".join(block.split())):
            if sentence:
                yield sentence


def document_figures(root: Path) -> Iterator[tuple[str, float]]:
    docs = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    words = sum(len(text_of(path).split()) for path in [*docs, root / "CHANGELOG.md"])
    yield "README, docs, CHANGELOG: words", words
    for path in (root / "README.md", root / "docs/ARCHITECTURE.md", root / "docs/RESULTS.md"):
        yield f"{path.stem}: lines", len(text_of(path).splitlines())
    lengths = [len(sentence.split()) for path in docs for sentence in sentences(text_of(path))]
    share = sum(length > LONG_SENTENCE for length in lengths) / max(len(lengths), 1)
    yield f"README, docs: sentences over {LONG_SENTENCE} words, %", round(100 * share, 1)


def figures(root: Path) -> Iterator[tuple[str, float]]:
    yield from library_figures(root)
    yield from header_figures(root)
    yield from setting_figures(root)
    tools = sum(len(text_of(path).splitlines()) for path in (root / "tools").rglob("*.py"))
    yield "tools: lines of Python", tools
    yield from document_figures(root)


# ---- words -------------------------------------------------------------------------------------------------


def found_words(text: str) -> Iterator[tuple[int, str]]:
    """Line number and the field's word for each of ours in a text; what stands as code is a name."""
    running = re.sub(r"`[^`\n]*`", lambda code: "x" * len(code[0]), text).replace("\n", " ")
    for word, ours in WORDS.items():
        for match in re.finditer(rf"\b(?:{ours})\b", running, re.IGNORECASE):
            yield text.count("\n", 0, match.start()) + 1, word


def word_places(root: Path) -> dict[str, list[str]]:
    """Where each of our words stands, by the field's word for it."""
    files = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    files += [root / "firmware" / name for name in (*PUBLIC_HEADERS, *READ_HEADERS)]
    found: dict[str, list[str]] = {}
    for path in files:
        for number, word in found_words(text_of(path)):
            found.setdefault(word, []).append(f"{path.relative_to(root)}:{number}")
    return found


# ---- the table ---------------------------------------------------------------------------------------------


def faults(today: dict[str, float], limits: dict[str, float]) -> Iterator[str]:
    """Figures above their limits; and limits of nothing, so that the table tells no tales."""
    for name in today:
        if name not in limits:
            yield f"{name}: limits.toml has no line of it"
        elif today[name] > limits[name]:
            yield f"{name}: {today[name]:g}, at most {limits[name]:g} are allowed"
    yield from (f"limits.toml: nothing is called {name}" for name in limits if name not in today)


def word_faults(places: dict[str, list[str]], allowed: dict[str, int]) -> Iterator[str]:
    for word, found in places.items():
        if len(found) > allowed.get(word, 0):
            for place in found:
                yield f"{place}: the field's word is: {word}"
    yield from (f"limits.toml: no word is called {word}" for word in allowed if word not in WORDS)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=Path(), help="the repository (default: here)")
    parser.add_argument("--limits", type=Path, default=TABLE, help="default: limits.toml beside this")
    options = parser.parse_args(argv)
    table = tomllib.loads(text_of(options.limits))
    today = dict(figures(options.root))
    places = word_places(options.root)
    for name, figure in today.items():
        print(f"{name:<52}{figure:>8g} of {table['figures'].get(name, 0):>6g}")
    for word, found in places.items():
        print(f"{'not ' + repr(word):<52}{len(found):>8} of {table['words'].get(word, 0):>6}")
    findings = [*faults(today, table["figures"]), *word_faults(places, table["words"])]
    for finding in findings:
        print(finding, file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
