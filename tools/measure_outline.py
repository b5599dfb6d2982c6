"""How well direction and distance are measured, and whether the variances that come with them hold.

Walks through rendered worlds; of every whole object of 150 px or more that is seen at less than 60 degrees
from its front and at most a tenth hidden, takes the error of direction and of distance. `--boxes rough`
(default) measures the true box with each edge moved by up to `--jitter` px, evenly; `--boxes detected` what
the detector finds of it. Columns: n; of how many percent it is measured; rms and 1.4826 median |error|; mean
square of error over standard deviation, and percent beyond three of these; percent marked as hidden. The
same follows for what bears no mark (hidden, part, cut off): the others are told to have rough directions. A
distance by the height of a kind that it is not does not count. `--hidden 0.25:0.9` asks for objects of which
that share is hidden, in place of whole ones. `--correlation` prints besides how alike an object's errors are
in two frames of a walk, by how far the robot moved between them.
`.venv/bin/python tools/measure_outline.py [--rig wide180] [--boxes detected] [--style train]`
"""

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from bslam.core.vision import Candidate, FrontEnd
from bslam.rig import load_rig
from bslam.world.camera import Frame, Renderer, Seen, make_world, walk
from training.detector_samples import CLASSES

FRAMES_A_WORLD = 25
WALK_HZ = 5.0
VISIBLE_PX_MIN = 150
HIDDEN_MAX = 0.1
SLANT_RAD_MAX = np.radians(60.0)
OVERLAP_MIN = 0.5
DISTANCES_M = ((1.5, 2.5), (2.5, 3.5), (3.5, 5.0), (5.0, 7.0), (7.0, 12.0))
MOVED_M = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.5)
CONTRADICTED_SDS = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
SURE = (0.0, 0.015, 0.02, 0.03, 0.04, 0.06, 0.10, 0.15)

ERROR = np.dtype(
    [
        ("world", np.int32),
        ("frame", np.int32),
        ("beacon_id", np.int32),
        ("kind", "U14"),
        ("distance_m", np.float64),
        ("pose", np.float64, 2),
        ("bearing", np.float64),  # error, degrees; NaN: not measured
        ("bearing_sd", np.float64),
        ("range", np.float64),  # error, a fraction of the distance; NaN: not measured
        ("range_sd", np.float64),
        ("misplaced_sds", np.float64),
        ("marked", np.bool_),  # as half hidden
        ("plain", np.bool_),  # no mark at all: the direction is told as a good one
    ]
)
Errors = NDArray[np.void]
Box = tuple[float, float, float, float]
Hidden = tuple[float, float]  # at least and at most


def visible_share(seen: Seen) -> float:
    """How much of an object nothing stands before."""
    return seen.visible_px / max(seen.own_px, 1)


def is_counted(seen: Seen, hidden: Hidden) -> bool:
    """Whether an object is one of those that are asked for."""
    whole = not seen.cut and seen.visible_px >= VISIBLE_PX_MIN
    return whole and hidden[0] <= 1.0 - visible_share(seen) <= hidden[1] and seen.slant_rad < SLANT_RAD_MAX


def overlap(a: Box, b: Box) -> float:
    """Intersection over union of two boxes."""
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    both = max(width, 0.0) * max(height, 0.0)
    return both / ((a[2] - a[0]) * (a[3] - a[1]) + (b[2] - b[0]) * (b[3] - b[1]) - both)


def rough_box(seen: Seen, frame: Frame, jitter_px: float, random: np.random.Generator) -> Box:
    """The true box, each edge moved by up to jitter_px, within the frame."""
    height, width = frame.rgb.shape[:2]
    moved = np.array(seen.box) + random.uniform(-jitter_px, jitter_px, 4)
    left, top, right, bottom = np.clip(moved, -0.5, [width - 0.5, height - 0.5] * 2).tolist()
    return left, top, right, bottom


def measured(
    front_end: FrontEnd,
    frame: Frame,
    found: tuple[Candidate, ...],
    hidden: Hidden,
    jitter_px: float,
    random: np.random.Generator,
) -> Iterator[tuple[Seen, Candidate | None]]:
    """Each counted object with what is measured of it. jitter_px negative: among the detected ones, and only
    those that were."""
    by_name = {one.name: one for one in CLASSES}
    for seen in (one for one in frame.seen if is_counted(one, hidden)):
        if jitter_px >= 0.0:
            yield (
                seen,
                front_end.measure(rough_box(seen, frame, jitter_px, random), by_name[seen.kind]),
            )
            continue
        least = OVERLAP_MIN * visible_share(seen)
        near = [one for one in found if overlap(one.outline, seen.box) >= least]
        if near:
            yield seen, max(near, key=lambda one: overlap(one.outline, seen.box))


def errors_of_world(seed: int, rig: str, style: str, hidden: Hidden, jitter_px: float) -> Errors:
    """Walks through one world with one camera of the rig."""
    cameras = load_rig(rig).cameras
    camera = cameras[seed % len(cameras)]
    scene = make_world(seed, style)
    renderer = Renderer(scene, camera, [seed, 0])
    front_end = FrontEnd([camera])
    random = np.random.default_rng([seed, 1])
    rows = []
    for step, (x_m, y_m, theta_rad) in enumerate(walk(scene, random, FRAMES_A_WORLD, WALK_HZ).tolist()):
        frame = renderer.render((x_m, y_m, theta_rad), step / WALK_HZ)
        found = front_end.see(frame.rgb).candidates
        for seen, candidate in measured(front_end, frame, found, hidden, jitter_px, random):
            bearing = bearing_sd = distance = distance_sd = np.nan
            if (
                candidate is not None
                and candidate.bearing_rad is not None
                and candidate.bearing_sd_rad is not None
            ):
                bearing = np.degrees(np.angle(np.exp(1j * (candidate.bearing_rad - seen.bearing_rad))))
                bearing_sd = np.degrees(candidate.bearing_sd_rad)
            if (
                candidate is not None
                and candidate.kind in ("", seen.kind)
                and candidate.range_m is not None
                and candidate.range_sd_m is not None
            ):
                distance = candidate.range_m / seen.range_m - 1.0
                distance_sd = candidate.range_sd_m / seen.range_m
            row = (seed, step, seen.beacon_id, seen.kind, seen.range_m, (x_m, y_m))
            marks = candidate.marks if candidate is not None else frozenset()
            misplaced_sds = candidate.misplaced_sds if candidate is not None else np.nan
            told = (bearing, bearing_sd, distance, distance_sd, misplaced_sds)
            rows.append((*row, *told, "hidden" in marks, not marks))
    return np.array(rows, ERROR)


def spread(errors: NDArray[np.floating]) -> str:
    """rms and 1.4826 median |error|, of those that were measured."""
    known = errors[np.isfinite(errors)]
    if not len(known):
        return "     -      -"
    return f"{np.sqrt(np.mean(known**2)):6.2f} {1.4826 * np.median(np.abs(known)):6.2f}"


def honesty(errors: NDArray[np.floating], sd: NDArray[np.floating]) -> str:
    """Mean square of error over standard deviation, 1 if that holds; and percent beyond three of them."""
    known = np.isfinite(errors)
    if not known.any():
        return "     -    -"
    square = (errors[known] / sd[known]) ** 2
    return f"{np.mean(square):6.2f} {100 * np.mean(square > 9.0):4.1f}"


def print_line(name: str, errors: Errors) -> None:
    has_bearing, has_range = np.isfinite(errors["bearing"]), np.isfinite(errors["range"])
    print(
        f"{name:13s}{len(errors):6d}   {100 * has_bearing.mean():4.0f} "
        f"{spread(errors['bearing'])} {honesty(errors['bearing'], errors['bearing_sd'])}   "
        f"{100 * has_range.mean():4.0f} {spread(100 * errors['range'])} "
        f"{honesty(errors['range'], errors['range_sd'])}   {100 * errors['marked'].mean():4.1f}"
        if len(errors)
        else f"{name:13s}     0"
    )


def print_distances(errors: Errors) -> None:
    for low, high in DISTANCES_M:
        print_line(f"{low}-{high} m", errors[(errors["distance_m"] >= low) & (errors["distance_m"] < high)])


def print_tables(errors: Errors) -> None:
    print("                   n   direction, deg                  distance, %                    marked,")
    print("                       has    rms median (e/sd)2 >3sd   has    rms median (e/sd)2 >3sd     %")
    print_distances(errors)
    print("without a mark:")
    print_distances(errors[errors["plain"]])
    middle = errors[(errors["distance_m"] >= 2.5) & (errors["distance_m"] < 7.0)]
    print_line("2.5-7 m", middle)
    for kind in sorted(set(middle["kind"].tolist())):
        print_line(kind, middle[middle["kind"] == kind])
    print("2.5-7 m, by the standard deviation that is given for the distance:")
    for low, high in pairwise(SURE):
        print_line(
            f"{100 * low:g}-{100 * high:g} %",
            middle[(middle["range_sd"] >= low) & (middle["range_sd"] < high)],
        )
    print("2.5-7 m, by how many standard deviations its sides contradict each other:")
    for low, high in pairwise(CONTRADICTED_SDS):
        off = middle["misplaced_sds"]
        print_line(f"{low}-{high}", middle[(off >= low) & (off < high)])


def correlations(errors: Errors, what: str) -> list[tuple[int, float]]:
    """Pairs of frames of one object, and the correlation of their errors over their standard deviations, by
    how far the robot moved between them."""
    known = errors[np.isfinite(errors[what])]
    scaled = np.clip(known[what] / known[f"{what}_sd"], -3.0, 3.0)  # a few wild ones would decide alone
    variance = np.mean(scaled**2)
    products: list[list[float]] = [[] for _ in MOVED_M[1:]]
    keys = known["world"].astype(np.int64) * 1000 + known["beacon_id"]
    for key in np.unique(keys):
        of_one = np.flatnonzero(keys == key)
        for i, a in enumerate(of_one):
            for b in of_one[i + 1 :]:
                moved_m = float(np.hypot(*(known["pose"][a] - known["pose"][b])))
                bin_index = int(np.searchsorted(MOVED_M, moved_m, side="right")) - 1
                if bin_index < len(products):
                    products[bin_index].append(float(scaled[a] * scaled[b]))
    return [(len(pairs), float(np.mean(pairs) / variance) if pairs else np.nan) for pairs in products]


def print_correlations(errors: Errors) -> None:
    middle = errors[(errors["distance_m"] >= 1.5) & (errors["distance_m"] < 7.0)]
    print("moved, m       pairs   direction      pairs    distance")
    by_what = [correlations(middle, what) for what in ("bearing", "range")]
    for low, high, bearing, distance in zip(MOVED_M[:-1], MOVED_M[1:], *by_what, strict=True):
        print(
            f"{low:.1f}-{high:.1f}     {bearing[0]:9d}   {bearing[1]:9.2f}  {distance[0]:9d}"
            f"   {distance[1]:9.2f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rig", default="three60", help="whose cameras, one a world (default three60)")
    parser.add_argument("--style", default="test", choices=("train", "test"))
    parser.add_argument("--worlds", default="0:60", help="seeds FIRST:END (default 0:60)")
    parser.add_argument("--boxes", default="rough", choices=("rough", "detected"))
    parser.add_argument("--jitter", type=float, default=3.0, help="of rough boxes, px (default 3)")
    parser.add_argument("--hidden", default=f"0:{HIDDEN_MAX}", help="share hidden, FROM:TO (default 0:0.1)")
    parser.add_argument("--correlation", action="store_true")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    arguments = parser.parse_args()
    first, end = (int(part) for part in arguments.worlds.split(":"))
    low, high = (float(part) for part in arguments.hidden.split(":"))
    jitter_px = arguments.jitter if arguments.boxes == "rough" else -1.0
    work = partial(
        errors_of_world,
        rig=arguments.rig,
        style=arguments.style,
        hidden=(low, high),
        jitter_px=jitter_px,
    )
    with ProcessPoolExecutor(arguments.jobs) as pool:
        errors = np.concatenate(
            list(tqdm(pool.map(work, range(first, end)), total=end - first, disable=None))
        )
    print_tables(errors)
    if arguments.correlation:
        print_correlations(errors)


if __name__ == "__main__":
    main()
