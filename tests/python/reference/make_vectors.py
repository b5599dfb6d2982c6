"""Writes tests/vectors/filter_runs.h: short runs, and what the NumPy reference makes of them after every
step.

    PYTHONPATH=tests/python .venv/bin/python -m reference.make_vectors

The C test tests/unit/slam/test_vectors.c feeds the same runs to the core. Twelve digits of the mean and ten
of the covariance: what the C test can see in double, and few enough that another machine's NumPy gives the
same ones.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

from reference.dense_ekf import DenseEkf, Sighting, motion_of_wheels
from reference.runs import PARAMS, STEP_S, Step, mount, run

HEADER = Path(__file__).resolve().parents[2] / "vectors" / "filter_runs.h"
BEACONS = 5  # the third is seen in direction only
SEED = 2024

RUNS: dict[str, tuple[int, dict[str, float]]] = {
    "standard": (20, {"filter": 0, "motion": 0, "velocity_states": 0}),
    "invariant": (40, {"filter": 1, "motion": 1, "velocity_states": 1}),
}
"""Name: number of steps, and what differs from reference.runs.PARAMS."""


def _filled(items: Iterable[str]) -> Iterator[str]:
    """Items separated by commas, in lines of at most 110 columns."""
    line = "   "
    for item in items:
        if len(line) + len(item) + 2 > 110:
            yield line
            line = "   "
        line += f" {item},"
    yield line


def _array(kind: str, name: str, items: Iterable[str]) -> Iterator[str]:
    yield f"static const {kind} {name}[] = {{"
    yield from _filled(items)
    yield "};"


def _params(name: str, params: dict[str, float]) -> Iterator[str]:
    yield f"static void {name}_params(bslam_settings_t *p)"
    yield "{"
    yield "    bslam_settings_preset(p, BSLAM_PRESET_PAPER);"
    for key, value in params.items():
        yield f"    p->{key} = {value};" if isinstance(value, int) else f"    p->{key} = BSLAM_R({value!r});"
    yield "}"


def _sighting(s: Sighting) -> str:
    return f"{{{s.label}, {s.bearing_rad:.12g}, {0.0 if s.range_m is None else s.range_m:.12g}}}"


def _rounded(step: Step) -> Step:
    """The step with the digits that the header has, so that both filters are fed the same."""
    sightings = [
        Sighting(
            s.label, float(f"{s.bearing_rad:.12g}"), None if s.range_m is None else float(f"{s.range_m:.12g}")
        )
        for s in step.sightings
    ]
    return Step(step.time_us, float(f"{step.left_m:.12g}"), float(f"{step.right_m:.12g}"), sightings)


def _run(name: str, step_count: int, params: dict[str, float]) -> Iterator[str]:
    """One run: parameters, inputs, and after each step the state's size, mean and lower triangle."""
    reference = DenseEkf(params)
    steps = [_rounded(step) for step in run(SEED, step_count, BEACONS, params)]
    sizes, means, covariances = [], [], []
    for step in steps:
        if step.time_us > 0:
            reference.predict(motion_of_wheels(params, step.left_m, step.right_m, STEP_S))
        reference.frame(step.sightings, mount(params))
        p = reference.covariance
        sizes.append(len(p))
        means += reference.mean.tolist()
        covariances += [p[i, j] for i in range(len(p)) for j in range(i + 1)]
    yield from _params(name, params)
    yield from _array(
        "vector_step_t",
        f"{name}_steps",
        (
            f"{{{s.time_us}, {s.left_m:.12g}, {s.right_m:.12g}, {len(s.sightings)}, {size}}}"
            for s, size in zip(steps, sizes, strict=True)
        ),
    )
    yield from _array(
        "vector_sighting_t", f"{name}_sightings", (_sighting(s) for step in steps for s in step.sightings)
    )
    yield from _array("double", f"{name}_means", (f"{value:.12g}" for value in means))
    yield from _array("double", f"{name}_covariances", (f"{value:.10g}" for value in covariances))


def text() -> str:
    """The header."""
    lines = [
        "// Written by tests/python/reference/make_vectors.py from the NumPy reference: not edited by hand.",
        "// Types and layout: tests/unit/slam/test_vectors.c.",
    ]
    for name, (step_count, kind) in RUNS.items():
        lines += ["", *_run(name, step_count, {**PARAMS, **kind})]
    return "\n".join(lines) + "\n"


def main() -> None:
    HEADER.parent.mkdir(exist_ok=True)
    HEADER.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    main()
