"""Changes the estimator's sources in one place at a time: how many of these mutants do the unit tests notice?

Examples:
    python -m tools.proofs.mutants                            500 of them, as many of each layer
    python -m tools.proofs.mutants --sample 40 --layers ekf   a few of one
    python -m tools.proofs.mutants --list                     what is known of the sample

`make mutants` builds what this needs and says how C is compiled. A mutant is compiled without sanitizers and
linked before the library. First the tests of its layer run, then all others. It is *killed* if one fails or
takes 5 s of the processor's time. It is the *same* if its object has the original's bytes, or if
tests/unit/mutants.toml tells why nothing can show it. The sample goes by a hash of the mutant's text, so it
stays when sources change elsewhere. What came of each is kept in out/mutants; it is asked again if its file
changes, a survivor if anything does. Exit status 0: the goals are reached; 1: not; 2: not built, or a verdict
that fits no mutant.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
CORE, TESTS, BUILD = ROOT / "firmware", ROOT / "tests/unit", ROOT / "build/unit/plain"
KNOWN = ROOT / "out/mutants/results.jsonl"
LAYERS = {
    "linalg": "bslam/linalg", "ekf": "bslam/ekf", "model": "bslam/model", "slam": "bslam/slam",
    "smoother": "bslam/smoother", "store": "bslam/store", "link": "link",
}  # fmt: skip
GOALS = dict.fromkeys(LAYERS, 0.92) | {"store": 1.0, "link": 1.0}
SEED, CPU_S = "mutants", 5
KINDS = ("killed", "survived", "same", "does not compile", "unknown")

# --- Mutants ------------------------------------------------------------------------------------------------

HIDDEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|^#(?:\\\n|[^\n])*|\b(?:static_)?assert\([^;]*;', re.M | re.S
)
SWAPS = {
    "<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&", "+": "-",
    "-": "+", "*": "/", "/": "*", "%": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "<<": ">>",
    ">>": "<<", "&": "|", "|": "&", "^": "&", "|=": "&=", "&=": "|=", "^=": "|=", "++": "--", "--": "++",
}  # fmt: skip
OPERATOR = r"(?<= )(?:[-+*/|&^]=?|[<>]=?|[=!]=|&&|\|\||%|<<|>>)(?=\s)|\+\+|--"
NUMBER = r"(?<![\w.\]])(?:0x[0-9a-f]+|\d+)u?(?![\w.])"
CALL = r"^ +(?! |return|const |static |goto|case)[^\n{};]*[^\n{};=]\([^\n{}]*;$"
ASSIGNMENT = r"^ +[\w.\[\]>*-]+ [-+*/|^&]?= [^\n{};]*;$|^ +(?:continue|break);$"
SCALAR = r"bool|int|u?int\d+_t|size_t|bslam_real_t|bslam_status_t|bslam_map_fault_t"
FUNCTION = rf"^(?:COPIED |static |inline )*(?:void|{SCALAR}) \**\w+\([^{{}};]*\)\n\{{\n"
# What is changed, and into what. A condition is what the bracket behind it holds.
CHANGES = (
    (OPERATOR, lambda found: SWAPS[found[0]]),
    (NUMBER, lambda found: f"({found[0]} + 1)"),
    (r"BSLAM_R\([^()]*\)", lambda found: f"(2 * {found[0]})"),
    (r"(?:(?<= if )|(?<=while ))(?=\()", lambda found: "!"),
    (CALL, lambda found: ";"),
    (ASSIGNMENT, lambda found: ";"),
    (r"(?<=[ (])-(?=[\w(])", lambda found: ""),
    (r"(?<= = )(?![{\"])[^;\n,]+(?=;$)", lambda found: f"-({found[0]})"),
    (r"\? ([^?:;]+?)(\s*) : ([^?:;,)}]+?)(?=[;,)}])", lambda found: f"? {found[3]}{found[2]} : {found[1]}"),
    (FUNCTION, lambda found: f"{found[0]}return{'' if 'void ' in found[0].split('(')[0] else ' 0'};\n"),
)


class Mutant(NamedTuple):
    """A text in place of another."""

    layer: str
    file: str  # below firmware
    begin: int
    end: int
    becomes: str
    key: str  # file, what stands there, what comes of it; with a number where that stands there again


def changes(text: str) -> Iterator[tuple[int, int, str]]:
    """Begin, end and new text of every change of a source, whose comments and strings are hidden."""
    for pattern, becomes in CHANGES:
        for found in re.finditer(pattern, text, re.M):
            if becomes(found) != "!":
                yield *found.span(), becomes(found)
                continue
            depth, end = 1, found.end() + 1
            while depth > 0:
                depth += {"(": 1, ")": -1}.get(text[end], 0)
                end += 1
            yield found.end(), end, f"(!{text[found.end() : end]})"


def mutants_of(layer: str) -> list[Mutant]:
    """All of a layer, in the order in which they are drawn."""
    mutants = []
    for path in sorted((CORE / LAYERS[layer]).glob("*.c")):
        source, file = path.read_text(encoding="utf-8"), path.relative_to(CORE).as_posix()
        times: Counter[str] = Counter()
        text = HIDDEN.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), source)
        for begin, end, becomes in sorted(changes(text)):
            first, last = source.rfind("\n", 0, begin) + 1, source.find("\n", end - 1)
            after = source[first:begin] + becomes + source[end:last]
            key = f"{file}: {' '.join(source[first:last].split())} => {' '.join(after.split())}"
            times[key] += 1
            key += f" #{times[key]}" if times[key] > 1 else ""
            mutants.append(Mutant(layer, file, begin, end, becomes, key))
    return sorted(mutants, key=lambda one: digest(SEED.encode(), one.key.encode()))


def digest(*parts: bytes) -> str:
    """Of all of them."""
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


# --- What comes of one --------------------------------------------------------------------------------------


def tests_for(layer: str) -> list[str]:
    """Programs: those of the layer, then all others that have it in them."""
    found = [path.relative_to(BUILD / "bin").as_posix() for path in (BUILD / "bin").rglob("test_*")]
    others = ("link/", "robot/") if layer == "link" else ("bslam/", "port/", "robot/")
    names = [name for name in sorted(found) if "." not in name and name.startswith(others)]
    return sorted(names, key=lambda name: not name.startswith(f"{LAYERS[layer]}/"))


def limit() -> None:
    """In a program that may never end."""
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
    resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def ends_well(*command: str | Path) -> bool:
    """Whether it does. What it prints goes nowhere: it may be endless."""
    words, null = [str(word) for word in command], subprocess.DEVNULL
    return subprocess.run(words, cwd=ROOT, stdout=null, stderr=null, preexec_fn=limit).returncode == 0


def link(test: str, first: Path, program: Path) -> bool:
    """Links a test as make does, with an object before the libraries."""
    folder = test.split("/", 1)[0]
    libraries = {"robot": ("robot", "bslam", "vision", "link"), "port": ("bslam",)}.get(folder, (folder,))
    inputs = [BUILD / f"tests/unit/{test}.o", first, *(BUILD / f"lib{name}.a" for name in libraries)]
    compiler, libs = os.environ["MUTANTS_CC"].split()[0], os.environ["MUTANTS_LIBS"].split()
    return ends_well(compiler, *inputs, BUILD / "helpers.a", *libs, "-o", program)


def ask(mutant: Mutant) -> str:
    """One of KINDS, or the test that killed it."""
    source = (CORE / mutant.file).read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        text, program = Path(folder, Path(mutant.file).name), Path(folder, "test")
        original, mutated = Path(folder, "1.o"), Path(folder, "2.o")
        compiler: tuple[str | Path, ...] = (*os.environ["MUTANTS_CC"].split(), "-w", "-g0", "-c", text, "-o")
        text.write_text(source, encoding="utf-8")
        ends_well(*compiler, original)
        text.write_text(source[: mutant.begin] + mutant.becomes + source[mutant.end :], encoding="utf-8")
        if not ends_well(*compiler, mutated):
            return "does not compile"
        if original.read_bytes() == mutated.read_bytes():
            return "same"
        for test in tests_for(mutant.layer):
            if not link(test, mutated, program) or not ends_well(program):
                return test
    return "survived"


class Results:
    """What came of mutants, kept."""

    def __init__(self) -> None:
        sources = sorted((*CORE.rglob("*.[ch]"), *TESTS.rglob("*.[ch]")))
        self.everything = digest(*(path.read_bytes() for path in sources))
        lines = KNOWN.read_text(encoding="utf-8").splitlines() if KNOWN.exists() else []
        self.known = {key: (state, verdict) for key, state, verdict in map(json.loads, lines)}

    def state(self, mutant: Mutant, verdict: str) -> str:
        """Of what a verdict hangs on."""
        return self.everything if verdict == "survived" else digest((CORE / mutant.file).read_bytes())

    def of(self, mutant: Mutant) -> str:
        """What is known and still holds, else "unknown"."""
        state, verdict = self.known.get(mutant.key, ("", "unknown"))
        return verdict if state == self.state(mutant, verdict) else "unknown"

    def add(self, mutant: Mutant, verdict: str) -> None:
        """Writes it down."""
        self.known[mutant.key] = (self.state(mutant, verdict), verdict)
        with KNOWN.open("a", encoding="utf-8") as file:
            file.write(json.dumps([mutant.key, *self.known[mutant.key]], ensure_ascii=False) + "\n")


def count(layer: str, sample: int, jobs: int, results: Results, excused: set[str]) -> Counter[str]:
    """How many there are of each of KINDS, `sample` that are killed or survive. jobs 0: asks none."""
    counts: Counter[str] = Counter()
    waiting = [mutant for mutant in mutants_of(layer) if mutant.key not in excused]
    counts["same"] = len(excused & {mutant.key for mutant in mutants_of(layer)})
    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        while waiting and (need := sample - counts["killed"] - counts["survived"] - counts["unknown"]) > 0:
            need = min(need, 2 * max(jobs, 1))  # so that little is lost when it is stopped
            some, waiting = waiting[:need], waiting[need:]
            unknown = [mutant for mutant in some if jobs > 0 and results.of(mutant) == "unknown"]
            for mutant, verdict in zip(unknown, pool.map(ask, unknown), strict=True):
                results.add(mutant, verdict)
                print(f"  {layer}, {verdict}: {mutant.key}"[:110], file=sys.stderr, flush=True)
            for mutant in some:
                verdict = results.of(mutant)
                counts[verdict if verdict in KINDS else "killed"] += 1
                if verdict == "survived":
                    print(f"survived: {mutant.key}")
    return counts


def report(rows: dict[str, Counter[str]]) -> bool:
    """Prints the table of layers. True: each reaches its goal."""
    print(f"{'layer':<10}" + "".join(f"{kind:>18}" for kind in KINDS) + f"{'killed, %':>11}{'goal':>6}")
    share = {name: row["killed"] / max(1, row["killed"] + row["survived"]) for name, row in rows.items()}
    for name, row in rows.items():
        cells = "".join(f"{row[kind]:>18}" for kind in KINDS)
        print(f"{name:<10}{cells}{100 * share[name]:>11.1f}{100 * GOALS[name]:>6.0f}")
    killed, survived = (sum(row[kind] for row in rows.values()) for kind in KINDS[:2])
    print(f"mutants: {killed} of {killed + survived} killed: {killed / max(1, killed + survived):.1%}")
    return all(share[name] >= GOALS[name] for name in rows)


def main(argv: list[str] | None = None) -> int:
    """Exit status as said above."""
    style = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=style)
    parser.add_argument("--sample", type=int, default=500, help="mutants that compile and differ (500)")
    parser.add_argument("--layers", nargs="+", choices=LAYERS, default=list(LAYERS), metavar="LAYER")
    parser.add_argument("--jobs", type=int, default=1, help="at a time (1)")
    parser.add_argument("--list", action="store_true", help="print what is known, run nothing")
    options = parser.parse_args(argv)
    verdicts = tomllib.loads((TESTS / "mutants.toml").read_text(encoding="utf-8"))
    excused = {one["mutant"] for one in verdicts["same"]}
    lost = excused - {mutant.key for layer in LAYERS for mutant in mutants_of(layer)}
    if lost or not (options.list or ("MUTANTS_CC" in os.environ and tests_for("ekf"))):
        print("mutants: not built (`make mutants` does it), or no mutants:", *sorted(lost), file=sys.stderr)
        return 2
    KNOWN.parent.mkdir(parents=True, exist_ok=True)
    results, each = Results(), -(-options.sample // len(options.layers))
    jobs = 0 if options.list else options.jobs
    rows = {layer: count(layer, each, jobs, results, excused) for layer in options.layers}
    return 0 if report(rows) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("mutants: stopped; the same command goes on (out/mutants)")
