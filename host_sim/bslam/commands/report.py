"""What a command that ran filters prints at its end, and its exit status."""

from __future__ import annotations

import statistics
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import filterfalse
from pathlib import Path
from typing import Any

from bslam.errors import BslamError
from bslam.maps.blob import SUFFIX
from bslam.runs.batch import BatchResult

# Heading, and how to get the text of an entry.
_COLUMNS = (
    ("mean cm", lambda e: _cm(e, "mean")),
    ("max cm", lambda e: _cm(e, "max")),
    ("rmse cm", lambda e: _cm(e, "rmse")),
    ("last 50 s", lambda e: _scaled(e, "position_error_last_50s_m")),
    ("odometry", lambda e: _scaled(e, "dead_reckoning_error_m")),
    ("bound", lambda e: _scaled(e, "bound_error_m")),
    ("NEES", lambda e: _number(e, "nees_mean", ".2f")),
    ("map cm", lambda e: _scaled(e, "map_rmse_m")),
    ("mapped", lambda e: _number(e, "beacons_mapped", ".4g")),
    ("of", lambda e: _number(e, "beacons_true", ".4g")),
    ("wrong", lambda e: _number(e, "wrong_associations", ".4g")),
    ("us/step", lambda e: _number(e, "step_us_median", ".0f")),
    ("", lambda e: "FAILED" if "error" in e else "DIVERGED" if e["diverged"] else ""),
)
HEADINGS = [heading for heading, _ in _COLUMNS]
_MOST_ROWS = 40
_MOST_NOTES = 20
_NAMED = 3


def finish(
    result: BatchResult, out: Path, text: str | None = None, more: str = "", means: bool = True
) -> int:
    """Print the runs (or `text` in their place), where the files are, and what has to be said of them; the
    exit status.

    Raises BslamError if an input was bad, after all that could run did.
    """
    print(text if text is not None else table([outcome.entry for outcome in result.outcomes], means))
    entries = [outcome.entry for outcome in result.outcomes]
    print(f"verdict: {verdict(entries)}")
    _say_each("presets", [", ".join(entry.get("presets", ())) for entry in entries])
    _say_each("align", [entry.get("align", "") for entry in entries])
    print(f"files in {out}: {', '.join(_files(result, more))}")
    for outcome in result.outcomes:
        if outcome.crash is not None:
            print(f"{outcome.name} failed:\n{outcome.crash}", file=sys.stderr)
    fit = _say_remarks(entries)
    if result.interrupted:
        print("stopped: what was finished is kept", file=sys.stderr)
    if result.bad_input is not None:
        raise BslamError(result.bad_input)
    return 0 if result.ok and fit else 1


def verdict(entries: Sequence[Mapping[str, Any]]) -> str:
    """How many runs are right, by what the others failed, and the worst figure.

    Right is what a truth was held against; and not where most of the log was left unused.
    """
    if not entries:
        return "nothing ran"
    failed, ran = [*filter(_has_failed, entries)], [*filterfalse(_has_failed, entries)]
    doubted, told = [*filter(_is_doubted, ran)], [*filter(_is_told, ran)]
    none_told = bool(ran) and not told
    if none_told:
        said = f"{len(ran)} of {len(entries)} ran"
    else:
        said = f"{len([*filterfalse(_is_doubted, told)])} of {len(entries)} right"
    if failed:
        said += f", {len(failed)} FAILED by {_reasons(failed)}: {_names(failed)}"
    if doubted:
        said += f", {len(doubted)} in doubt: {_names(doubted)}"
    if len(told) < len(ran):
        whose = "" if none_told else f" of {len(ran) - len(told)}"
        said += f"; no truth tells{whose} whether it is right"
    return said + _worst(entries)


def _has_failed(entry: Mapping[str, Any]) -> bool:
    return bool(entry.get("failed", entry["diverged"]))


def _is_doubted(entry: Mapping[str, Any]) -> bool:
    return bool(entry.get("problems"))


def _is_told(entry: Mapping[str, Any]) -> bool:
    """Whether a truth was held against it."""
    return "position_error_m" in entry or "map_one_to_one" in entry


def _reasons(failed: Sequence[Mapping[str, Any]]) -> str:
    by = Counter(reason for one in failed for reason in one.get("failed_by", ["error"]))
    return ", ".join(f"{one} ({by[one]})" for one in by)


def _worst(entries: Sequence[Mapping[str, Any]]) -> str:
    """The largest mean error, and whose it is; nothing where no error is known."""
    scored = [one for one in entries if "position_error_m" in one]
    if not scored:
        return ""
    worst = max(scored, key=lambda one: one["position_error_m"]["mean"])
    return f"; worst mean error {100.0 * worst['position_error_m']['mean']:.1f} cm, {worst['name']}"


def _names(entries: Sequence[Mapping[str, Any]]) -> str:
    names = ", ".join(str(one["name"]) for one in entries[:_NAMED])
    return names + (", ..." if len(entries) > _NAMED else "")


def _say_remarks(entries: Sequence[dict[str, Any]]) -> bool:
    """What is to be said of each run; whether none has a problem."""
    notes, problems = (
        [f"{one['name']}: {text}" for one in entries for text in one.get(key, ())]
        for key in ("notes", "problems")
    )
    more = [f"{len(notes) - _MOST_NOTES} more notes in summary.json"] if len(notes) > _MOST_NOTES else []
    for text in [*notes[:_MOST_NOTES], *more, *problems]:
        print(text, file=sys.stderr)
    return not problems


def _say_each(what: str, words: Sequence[str]) -> None:
    """Each different word once."""
    different = dict.fromkeys(filter(None, words))
    if different:
        print(f"{what}: {'; '.join(different)}")


def _files(result: BatchResult, more: str) -> list[str]:
    """What was written, a run that failed having left nothing."""
    files = ["summary.json"]
    if not all(outcome.failed for outcome in result.outcomes):
        known = any("position_error_m" in outcome.entry for outcome in result.outcomes)
        truth = ["NAME.truth.tum"] if known else []
        files += ["NAME.estimate.tum", *truth, "NAME.map.csv", f"NAME{SUFFIX}", "*.png"]
    return files + ([more] if more else [])


def table(entries: Sequence[dict[str, Any]], means: bool = True) -> str:
    """One line a run, and if wanted a last line with the means of several."""
    rows = [[entry["name"], *(text(entry) for _, text in _COLUMNS)] for entry in entries[:_MOST_ROWS]]
    if len(entries) > _MOST_ROWS:
        rows.append([f"... {len(entries) - _MOST_ROWS} more in summary.json", *("" for _ in _COLUMNS)])
    if means and len(entries) > 1:
        rows.append(mean_row(f"mean of {len(entries)}", entries))
    associations = {str(entry["association"]) for entry in entries}
    title = f"run, {associations.pop()}" if len(associations) == 1 else "run"
    return table_of([[title, *HEADINGS], *rows])


def table_of(rows: Sequence[Sequence[str]]) -> str:
    """Text in columns: the first to the left, the others to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        numbers = [text.rjust(width) for text, width in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join([row[0].ljust(widths[0]), *numbers]).rstrip())
    return "\n".join(lines)


def mean_row(name: str, entries: Sequence[dict[str, Any]]) -> list[str]:
    """Means over the runs that have a figure, lost ones included; the last column counts these, and those
    that gave none."""
    failed = sum("error" in entry for entry in entries)
    counts = {"FAILED": failed, "lost": sum(bool(entry["diverged"]) for entry in entries) - failed}
    mean, said = _mean_entry(entries), ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    return [name, *(text(mean) for _, text in _COLUMNS[:-1]), said]


def _mean_entry(entries: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Mean of every number that all or some entries have."""
    mean: dict[str, Any] = {}
    for key in {key for entry in entries for key in entry}:
        values = [entry[key] for entry in entries if key in entry]
        if all(isinstance(value, (int, float)) for value in values):
            mean[key] = round(statistics.fmean(values), 6)
        elif all(isinstance(value, dict) for value in values):
            mean[key] = _mean_entry(values)
    return mean


def _cm(entry: dict[str, Any], figure: str) -> str:
    return _scaled(entry.get("position_error_m", {}), figure)


def _scaled(entry: dict[str, Any], figure: str) -> str:
    return f"{100.0 * entry[figure]:.2f}" if figure in entry else "-"


def _number(entry: dict[str, Any], figure: str, form: str) -> str:
    return format(entry[figure], form) if figure in entry else "-"
