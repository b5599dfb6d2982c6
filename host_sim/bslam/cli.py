"""The command line: `bslam COMMAND [options]`.

Exit status 0: all ran; 1: a run failed or was stopped; 2: bad input, the last line on stderr says what,
where, and what is allowed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from types import ModuleType

try:
    from bslam.commands import (
        calibrate,
        check,
        compare,
        console,
        detect,
        export,
        faults,
        import_log,
        kept_maps,
        live,
        look,
        params,
        replay,
        report_page,
        run,
        scenario,
        stress,
        sweep,
        tables,
    )
    from bslam.commands.helping import ShortHelp
    from bslam.commands.parser import Parser
    from bslam.errors import BslamError, did_you_mean
except KeyboardInterrupt:  # they take a second or two
    sys.exit("bslam: stopped")

COMMANDS: dict[str, ModuleType] = {
    "run": run,
    "replay": replay,
    "check": check,
    "tables": tables,
    "sweep": sweep,
    "stress": stress,
    "compare": compare,
    "live": live,
    "report": report_page,
    "look": look,
    "detect": detect,
    "calibrate": calibrate,
    "console": console,
    "export": export,
    "import": import_log,
    "scenario": scenario,
    "map": kept_maps,
    "faults": faults,
    "params": params,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if not words or words[0] in ("-h", "--help", "--help-all", "help"):
        print(_overview())
        return 0 if words else 2
    if words[0] == "--version":
        print(f"bslam {version('bslam')}")
        return 0
    name, *rest = words
    try:
        if name not in COMMANDS:
            near = did_you_mean(name, COMMANDS) or _with_an_action(name)
            allowed = f"allowed: {', '.join(COMMANDS)}{near}"
            raise BslamError(f"command '{name}' does not exist; {allowed}")
        command = COMMANDS[name]
        # Not argparse's own sub-parsers: with them options could not stand between two directories.
        status = int(command.execute(_parser(name, command).words(rest)))
        sys.stdout.flush()
        return status
    except BslamError as error:
        print(f"bslam {name}: error: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        # Whoever read the output has gone, as `head` does: nothing is left to say, at the exit neither.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        print(f"bslam {name}: stopped", file=sys.stderr)
        return 1


def _parser(name: str, command: ModuleType) -> Parser:
    parser = Parser(
        prog=f"bslam {name}",
        description=command.SUMMARY,
        epilog=command.EXAMPLES,
        formatter_class=ShortHelp,
        allow_abbrev=False,
    )
    command.add_arguments(parser)
    return parser


def _with_an_action(word: str) -> str:
    """What to append where a word is no command, but says what one does; "" where it does not."""
    for name, command in COMMANDS.items():
        for one in _parser(name, command)._actions:
            if not one.option_strings and word in (one.choices or ()):
                return f"; did you mean `bslam {name} {word}`?"
    return ""


def _overview() -> str:
    lines = [
        "usage: bslam COMMAND [options]",
        "       bslam --version",
        "",
        "SLAM with beacons that fits in a microcontroller.",
        "",
        "commands:",
    ]
    lines += [f"  {name:10} {command.SUMMARY.splitlines()[0]}" for name, command in COMMANDS.items()]
    lines += [
        "",
        "examples:",
        "  bslam run paper_room",
        "  bslam tables --seeds 0:10",
        "  bslam COMMAND --help, and --help-all with every option",
    ]
    return "\n".join(lines)
