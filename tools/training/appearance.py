"""What a sighting's appearance is worth as evidence: fits firmware/bslam/appearance/calibration.c.

Drives apart from all tests are shown to the learner as a robot would: a sample of each beacon every 10 cm.
When a beacon comes into view, each classifier says how near the sighting is to what it keeps and how it
decides. A logistic function of these, and of the logarithm of how many samples there are, says how likely it
is that beacon. Both answers, and all counts of samples, weigh alike. So do, of the others, those that some
classifier knows and those that come into view for the first time, which none was taught to refuse.

    python -m tools.training.appearance                       # 20 min on two cores
    python -m tools.training.appearance --camera 70000:70000  # simulated looks alone
"""

from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression

from bslam.core.appearance import encode
from bslam.log import Log
from bslam.rig import load_rig
from bslam.runs.camera import CameraStore, camera_log
from bslam.world.simulate import load_scenario, simulate

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
TARGET = FIRMWARE / "bslam/appearance/calibration.c"
CLASSIFIERS = 80
SAMPLE_EVERY_M, VIEW_US, VIEW_FRAMES = 0.1, 1_000_000, (1, 3, 5)
COUNTS = ((1, 1), (2, 3), (4, 8), (9, 16))  # of samples, which weigh alike
ODDS_MAX = 8.0
SHARES = (0.5, 0.25, 0.25)  # of the answers: that beacon, another that is known, a new one
Row = tuple[float, float, float, float, float, float]
METHODS = {  # by name: whether it looks at kept samples, at their middle, at the decision value
    "SVM": (False, False, True),
    "NEAREST": (True, False, False),
    "CENTROID": (True, True, False),
    "BOTH": (True, False, True),
}

_SHIM = """#include "bslam/appearance/learner.h"
static bslam_learner_t learner;
int begin(const bslam_sample_t *seeds, int count);
int begin(const bslam_sample_t *seeds, int count) { return bslam_learner_init(&learner, seeds, count); }
int add(void);
int add(void)
{
    int32_t classifier = -1;
    return bslam_learner_add(&learner, &classifier) == BSLAM_OK ? classifier : -1;
}
int show(int classifier, const float *signature);
int show(int classifier, const float *signature)
{
    const int status = bslam_learner_show(&learner, classifier, signature);
    bslam_learner_work(&learner, 600);
    return status;
}
int ask(int classifier, const bslam_sample_t *sample, float *answer);
int ask(int classifier, const bslam_sample_t *sample, float *answer)
{
    const bslam_classifier_t *one = &learner.classifiers[classifier];
    const bslam_sample_t *kept = &learner.samples[classifier * BSLAM_SAMPLES_PER_CLASSIFIER];
    if (!bslam_learner_knows(&learner, classifier)) {
        return 0;
    }
    answer[0] = bslam_sample_distance2(&kept[0], sample);
    for (int i = 1; i < one->samples; i++) {
        const float next = bslam_sample_distance2(&kept[i], sample);
        answer[0] = next < answer[0] ? next : answer[0];
    }
    answer[1] = bslam_sample_middle_distance2(kept, one->samples, sample);
    answer[2] = bslam_sample_decide(&one->weights, sample);
    return one->samples;
}
"""


def _pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def learner(folder: Path) -> ctypes.CDLL:
    """The C learner as a library of its own: a classifier a beacon, and one learner a process."""
    source, library = folder / "learner.c", folder / "learner.so"
    source.write_text(_SHIM, encoding="utf-8")
    parts = [FIRMWARE / f"bslam/appearance/{one}.c" for one in ("learner", "sample", "solver", "training")]
    command = [os.environ.get("CC", "cc"), "-std=c11", "-O2", "-ffp-contract=off", "-shared", "-fPIC"]
    command += [f"-I{FIRMWARE}", f"-DBSLAM_LEARNER_SLOTS={CLASSIFIERS}", str(source), *map(str, parts)]
    subprocess.run([*command, "-lm", "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


def views(log: Log) -> list[Row]:
    """Rows (samples, nearest, middle, value, is that beacon, is a known one) of a drive."""
    assert log.truth is not None and log.seeds is not None and log.sightings.signature is not None
    with tempfile.TemporaryDirectory() as folder:
        library = learner(Path(folder))
    seeds = encode(log.seeds, "float")
    library.begin(_pointer(seeds), len(seeds))
    step_m = np.hypot(np.diff(log.truth.x_m), np.diff(log.truth.y_m))
    way_m = np.interp(log.sightings.time_us, log.truth.time_us, np.concatenate([[0.0], np.cumsum(step_m)]))
    samples = encode(log.sightings.signature, "float")
    signatures = np.ascontiguousarray(log.sightings.signature, np.float32)
    classifiers: dict[int, int] = {}
    last: dict[int, tuple[int, int, float]] = {}  # when it was seen, in which frame of its view; shown where
    rows: list[Row] = []
    answer = np.zeros(3, np.float32)
    for i in np.flatnonzero(log.sightings.beacon_id >= 0):
        beacon, time_us = int(log.sightings.beacon_id[i]), int(log.sightings.time_us[i])
        seen_us, frame, shown_m = last.get(beacon, (-VIEW_US - 1, 0, -1.0))
        frame = 1 if time_us - seen_us > VIEW_US else frame + 1
        for other, classifier in classifiers.items() if frame in VIEW_FRAMES else ():
            count = library.ask(classifier, _pointer(samples[i]), _pointer(answer))
            nearest, middle = np.sqrt(answer[:2]) / 127.0
            whose = float(other == beacon), float(beacon in classifiers)
            row = (count, float(nearest), float(middle), float(answer[2]), *whose)
            rows += [row] if count > 0 else []
        if beacon not in classifiers:
            classifiers[beacon] = library.add()
        if way_m[i] - shown_m >= SAMPLE_EVERY_M:
            shown_m = float(way_m[i])
            library.show(classifiers[beacon], _pointer(signatures[i]))
        last[beacon] = (time_us, frame, shown_m)
    return rows


def _simulated(seed: int) -> list[Row]:
    scenario = ("paper_room", "building20")[seed % 2]
    return views(simulate(load_scenario(scenario), seed, 0.3))


def _rendered(seed: int) -> list[Row]:
    scenario = ("paper_room", "building20")[seed % 2]
    store = CameraStore(ROOT / "out/appearance")
    log = camera_log(load_scenario(scenario), seed, None, None, load_rig("three60"), store)
    return views(log)


@dataclass(frozen=True)
class Views:
    """Of many drives (n,): samples, distances, decision value; that beacon? a known one? in which drive."""

    samples: NDArray[np.float64]
    nearest: NDArray[np.float64]
    middle: NDArray[np.float64]
    value: NDArray[np.float64]
    is_it: NDArray[np.bool_]
    is_known: NDArray[np.bool_]
    drive: NDArray[np.int64]

    def columns(self, method: str) -> NDArray[np.float64]:
        """What a method looks at, (n, 6), in the order of bslam_calibration_t."""
        kept, middle, value = METHODS[method]
        distance = (self.middle if middle else self.nearest) * kept
        decided = self.value * value
        more = np.log(self.samples)
        one = np.ones_like(more)
        return np.stack([one, distance, decided, more, more * distance, more * decided], axis=1)

    def answers(self) -> tuple[NDArray[np.bool_], ...]:
        """Rows of each of SHARES."""
        return self.is_it, ~self.is_it & self.is_known, ~self.is_known

    def bins(self) -> Iterator[NDArray[np.bool_]]:
        """Rows of each range of COUNTS."""
        return ((self.samples >= low) & (self.samples <= high) for low, high in COUNTS)


def collect(seeds: range, one: Callable[[int], list[Row]], jobs: int) -> Views | None:
    """Of all drives."""
    if len(seeds) == 0:
        return None
    with ProcessPoolExecutor(jobs) as pool:
        drives = list(pool.map(one, seeds))
    rows = np.array([row for drive in drives for row in drive])
    numbers = np.concatenate([np.full(len(drive), i) for i, drive in enumerate(drives)])
    samples, nearest, middle, value, is_it, is_known = rows.T
    return Views(samples, nearest, middle, value, is_it > 0.5, is_known > 0.5, numbers)


def fit(views_of: list[Views], method: str, kept: list[NDArray[np.bool_]]) -> NDArray[np.float64]:
    """Coefficients (6,): each source, count of samples and answer weighs alike. `kept`: rows to fit on."""
    columns = np.concatenate([one.columns(method)[use] for one, use in zip(views_of, kept, strict=True)])
    answers = np.concatenate([one.is_it[use] for one, use in zip(views_of, kept, strict=True)])
    weights = []
    for one, use in zip(views_of, kept, strict=True):
        weight = np.zeros(len(one.is_it))
        for rows in one.bins():
            for answer, share in zip(one.answers(), SHARES, strict=True):
                chosen = rows & answer & use
                weight[chosen] = 1e4 * share / max(1, chosen.sum())
        weights.append(weight[use])
    moves = columns.std(axis=0) > 0
    model = LogisticRegression(C=1e6, max_iter=10_000)
    model.fit(columns[:, moves], answers, sample_weight=np.concatenate(weights))
    coefficients = np.zeros(6)
    coefficients[moves] = model.coef_[0]
    coefficients[0] = model.intercept_[0]
    return coefficients


def log_loss(
    views: Views, method: str, coefficients: NDArray[np.float64], use: NDArray[np.bool_]
) -> list[float]:
    """Balanced, for each range of COUNTS."""
    odds = np.clip(views.columns(method) @ coefficients, -ODDS_MAX, ODDS_MAX)
    loss = np.log1p(np.exp(np.where(views.is_it, -odds, odds)))
    parts = list(zip(views.answers(), SHARES, strict=True))
    return [sum(part * float(loss[rows & use & one].mean()) for one, part in parts) for rows in views.bins()]


def _line(method: str, coefficients: NDArray[np.float64]) -> str:
    numbers = [f"{one:.3f}f" if one else "0" for one in coefficients] + [str(METHODS[method][1]).lower()]
    return f"    static const bslam_calibration_t {method} = {{{', '.join(numbers)}}};"


def write(table: dict[str, NDArray[np.float64]]) -> None:
    """The coefficients, in place of those that stand in the C file."""
    text = TARGET.read_text(encoding="utf-8").splitlines()
    kept = [line for line in text if not line.startswith("    static const bslam_calibration_t")]
    at = (
        kept.index("{", kept.index("const bslam_calibration_t *bslam_calibration_of(int32_t association)"))
        + 1
    )
    kept[at:at] = [_line(method, coefficients) for method, coefficients in table.items()]
    TARGET.write_text("\n".join(kept) + "\n", encoding="utf-8")


def _range(text: str) -> range:
    first, last = text.split(":")
    return range(int(first), int(last))


def main() -> None:
    """Fits on all drives; prints the loss on each half of them by the other half."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--simulated", type=_range, default=range(60000, 60048), help="seeds A:B")
    parser.add_argument("--camera", type=_range, default=range(60000, 60008), help="the same, rendered")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    sources = {
        "simulated": collect(options.simulated, _simulated, options.jobs),
        "camera": collect(options.camera, _rendered, options.jobs),
    }
    given = {name: one for name, one in sources.items() if one is not None}
    table = {}
    print("balanced log loss, samples", *(f"{low}-{high}" for low, high in COUNTS))
    for method in METHODS:
        views_of = list(given.values())
        table[method] = fit(views_of, method, [np.full(len(one.is_it), True) for one in views_of])
        halves = [fit(views_of, method, [one.drive % 2 == half for one in views_of]) for half in (0, 1)]
        for name, one in given.items():
            losses = [log_loss(one, method, halves[half], one.drive % 2 != half) for half in (0, 1)]
            print(f"{method:9s} {name:9s}", *(f"{loss:.3f}" for loss in np.mean(losses, axis=0)))
    write(table)
    print(f"wrote {TARGET.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
