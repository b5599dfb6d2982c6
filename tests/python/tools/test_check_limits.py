"""tools/checks/check_limits.py counts what it says, and reports what is too much."""

from pathlib import Path

import pytest

from tools.checks import check_limits

ROOT = Path(__file__).resolve().parents[3]

CODE = """/// A comment.
#include <stdint.h>

/* one
   more */
int a;  // behind code
"""

HEADER = """# 1 "/usr/include/string.h" 1
extern void *memcpy(void *to, const void *from, unsigned long count);
# 1 "firmware/bslam/bslam.h" 1
typedef struct flash {
    _Bool (*erase)(void *context, int slot);
} flash_t;
__attribute__((warn_unused_result)) int bslam_take(flash_t *flash,
                                                   int count);
static inline int bslam_half(int a) { if (a) { return a / 2; } return 0; }
typedef int (*call_t)(int);
# 3 "/usr/include/math.h" 2
extern double sqrt(double x);
# 9 "firmware/bslam/bslam.h" 2
void bslam_stop(void);
"""


def test_code_lines_leave_out_comments_and_blanks() -> None:
    assert check_limits.code_lines(CODE) == 2


def test_declared_functions_are_those_of_the_project() -> None:
    assert check_limits.declared_functions(HEADER, "firmware/") == ["bslam_take", "bslam_half", "bslam_stop"]


def test_sizes_are_macros_with_a_default(tmp_path: Path) -> None:
    for folder, text in {
        "base": "#ifndef GUARD_H\n#define GUARD_H\n#ifndef REAL\n#define REAL 0\n#endif\n",
        "bslam": "#ifndef BEACONS\n#define BEACONS 20\n#endif\n"
        "// only the tests set them\n#ifndef STEPS\n#define STEPS 2\n#endif\n",
    }.items():
        (tmp_path / "firmware" / folder).mkdir(parents=True)
        (tmp_path / "firmware" / folder / "config.h").write_text(text, encoding="utf-8")
    assert check_limits.sizes_of(tmp_path, "bslam") == ["REAL", "BEACONS"]


def test_settings_are_counted_as_the_library_counts_them() -> None:
    text = check_limits.text_of(ROOT / "firmware/bslam/settings.h")
    assert check_limits.table_rows(text, "BSLAM_SETTINGS") > 40
    assert (
        check_limits.table_rows("#define T(REAL, INTEGER) \\\n REAL(a, 1) \\\n INTEGER(b, 2)\n\n", "T") == 2
    )


def test_sentences_leave_out_code_tables_and_headings() -> None:
    text = """# A heading. Of two.

One sentence. Another `with.a.dot` of $x. Y$ in
two lines.

```
no sentence. At all.
```
| a | table. Too |
- An item.
- One more
"""
    assert [len(one.split()) for one in check_limits.sentences(text)] == [2, 7, 3, 3]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("The looks of a beacon.", ["appearance"]),
        ("It looks like a beacon; a robot looks at it, and how it looks.", []),
        ("By position and looks; looks count half.", ["appearance", "appearance"]),
        ("Its machine was taught.", ["classifier", "trained"]),
        ("A support vector machine, from this machine to another\nmachine.", []),
        ("a support vector\nmachine, *Machine\nLearning*, the machine's byte order, told apart", []),
        ("Identities are told, in direction only.", ["known data association", "bearing-only"]),
        ("The robot is carried away; the pose is carried on.", ["kidnapped"]),
        (
            "The twin, a glance, two rivals.",
            ["competitor, negative sample", "pre-filter", "double-precision build"],
        ),
        ("Measured by hand, with `told`.", ["(no such figure)"]),
        ("By handing it over, in trusted code, untold, 2 parts, a double.", []),
    ],
)
def test_words_of_the_house_are_found(text: str, words: list[str]) -> None:
    assert [word for _line, word in check_limits.found_words(text)] == words


def test_word_has_its_line() -> None:
    assert list(check_limits.found_words("one\ntwo told\n")) == [(2, "known data association")]


def test_faults_are_figures_above_their_limit_and_lines_that_do_not_fit() -> None:
    today = {"lines": 10, "words": 5, "new": 1}
    assert list(check_limits.faults(today, {"lines": 9, "words": 5, "old": 3})) == [
        "lines: 10, at most 9 are allowed",
        "new: limits.toml has no line of it",
        "limits.toml: nothing is called old",
    ]


def test_word_faults_name_every_place_once_there_are_too_many() -> None:
    places = {"trained": ["a.md:1", "b.md:2"]}
    assert list(check_limits.word_faults(places, {"trained": 2})) == []
    assert len(list(check_limits.word_faults(places, {"trained": 1}))) == 2
    assert list(check_limits.word_faults({}, {"magic": 1})) == ["limits.toml: no word is called magic"]


def test_main_prints_each_figure_beside_its_limit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = check_limits.text_of(check_limits.TABLE)
    tight = tmp_path / "limits.toml"
    tight.write_text(table.replace('"settings" = 45', '"settings" = 5'), encoding="utf-8")
    assert check_limits.main(["--root", str(ROOT), "--limits", str(tight)]) == 1
    printed = capsys.readouterr()
    assert "of      5" in printed.out
    assert "settings: " in printed.err
    assert "at most 5 are allowed" in printed.err
