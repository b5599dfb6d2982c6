"""How well signatures tell beacons apart: rendered ones in other light, and real ones from other sides.

Rendered: `--views` signatures of each beacon of a dressed scenario in one lighting, by one camera, train one
machine a beacon; others in another lighting, by another camera, are named by the largest value. The camera
sees each beacon whole, from 1.2 to 6.5 m, at less than 60 degrees; boxes are up to 2 px off on each side; the
wall's colour is what the front end's running colours say after a short turn.
Photographs: ETH-80, 40 objects of 41 views, in the directory that BSLAM_DATA names, else ../shared/data. The
training views are spread over the half sphere, the others lie at least 20 degrees from all of them. The
object stands before a grey wall (as the mask tells), or before its own blue ground; the box is the mask's.
Two columns each: machines on the values as they are with C = 10, as a robot learns; and standardised, C by
cross-validation, as `train_beacons.py` does it.
`.venv/bin/python tools/measure_signature.py [--scenes paper_room:1 building50:1] [--photographs]`
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from sklearn.svm import LinearSVC

from bslam.core.vision import FrontEnd
from bslam.rig import load_rig
from bslam.world.camera import BeaconLook, Renderer, Scene, dress, free_pose
from bslam.world.scenario import load_scenario
from measure_outline import HIDDEN_MAX, is_counted, rough_box
from training.eth80 import WALL_GREY, Picture, View, archive_path, read_photographs
from training.fit import choose_cost, fit, one_vs_rest

TEST_VIEWS = 15
NEAR_M, FAR_M = 1.2, 6.5
SLANT_RAD_MAX = np.radians(58.0)
ASIDE_RAD_MAX = np.radians(18.0)
TURN_RAD = (0.6, 0.4, 0.2, 0.1, 0.0)  # the camera turns towards a beacon before its signature is taken
JITTER_PX = 2.0
TRIES_A_VIEW = 12
OTHER_LIGHT = 1000
ROBOT_COST = 10.0

APART_RAD = np.radians(20.0)
SPLITS = 5
FRAME_PX = (240, 320)
CORNER_PX = (56, 96)

Signatures = dict[int, list[NDArray[np.float32]]]


# --- Telling apart


def tabled(signatures: Signatures) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Signatures (n, 71), and whose they are (n,): an index into the sorted names."""
    x = [one for name in sorted(signatures) for one in signatures[name]]
    y = [index for index, name in enumerate(sorted(signatures)) for _ in signatures[name]]
    return np.array(x, np.float64), np.array(y)


def share_on_robot(train: Signatures, test: Signatures) -> float:
    """Share of test signatures that get the right name by machines as a robot learns them."""
    x_test, y_test = tabled(test)
    machines = LinearSVC(C=ROBOT_COST, dual=False, max_iter=20000).fit(*tabled(train))
    return float(np.mean(machines.predict(x_test) == y_test))


def share_offline(train: Signatures, test: Signatures) -> float:
    """The same by machines as `train_beacons.py` fits them."""
    x, y = tabled(train)
    x_test, y_test = tabled(test)
    targets = one_vs_rest(y, len(train))
    machine = fit(x, targets, choose_cost(x, targets)[0])
    return float(np.mean(machine.decide(x_test).argmax(axis=1) == y_test))


# --- Rendered


def good_places(
    scene: Scene, beacon: BeaconLook, random: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    """Poses that look at a beacon about from its front; whether it is seen, only a picture tells."""
    while True:
        x_m, y_m, _ = free_pose(scene, random)
        to_x, to_y = beacon.x_m - x_m, beacon.y_m - y_m
        bearing_rad = float(np.arctan2(to_y, to_x))
        slant_rad = abs(np.angle(np.exp(1j * (bearing_rad + np.pi - beacon.facing_rad))))
        if NEAR_M <= np.hypot(to_x, to_y) <= FAR_M and slant_rad < SLANT_RAD_MAX:
            yield x_m, y_m, bearing_rad + random.uniform(-ASIDE_RAD_MAX, ASIDE_RAD_MAX)


def take_signatures(scene: Scene, seed: int, light: int, views: int) -> Signatures:
    """About `views` signatures of each beacon; of one that is hardly ever seen whole, fewer."""
    camera = load_rig("three60").cameras[1]
    renderer = Renderer(scene, camera, [seed, light])
    random = np.random.default_rng([seed, light])
    taken: Signatures = {beacon.beacon_id: [] for beacon in scene.beacons}
    time_s = 1000.0 * light
    for beacon in scene.beacons:
        places = good_places(scene, beacon, random)
        for _ in range(TRIES_A_VIEW * views):
            if len(taken[beacon.beacon_id]) >= views:
                break
            x_m, y_m, theta_rad = next(places)
            front_end = FrontEnd([camera])
            for turn_rad in TURN_RAD:
                frame = renderer.render((x_m, y_m, theta_rad + turn_rad), time_s)
                front_end.see(frame.rgb)
                time_s += 0.2
            for seen in (one for one in frame.seen if is_counted(one, (0.0, HIDDEN_MAX))):
                signature = front_end.signature(rough_box(seen, frame, JITTER_PX, random))
                if signature is not None and len(taken[seen.beacon_id]) < views:
                    taken[seen.beacon_id].append(signature)
    return taken


def measure_scene(name: str, seed: int, views: int) -> tuple[float, float]:
    """Prints the line of one dressed scenario; the shares in it."""
    scenario = load_scenario(name)
    scene = dress(scenario, seed)
    other = replace(scene, lighting=dress(scenario, seed + OTHER_LIGHT).lighting)
    train = take_signatures(scene, seed, 0, views)
    test = take_signatures(other, seed, 1, TEST_VIEWS)
    kept = [one for one in train if len(train[one]) >= views and test[one]]
    parts = {one: train[one] for one in kept}, {one: test[one] for one in kept}
    robot, offline = share_on_robot(*parts), share_offline(*parts)
    count = sum(len(test[one]) for one in kept)
    print(
        f"{name}:{seed}  {len(kept)} beacons, {count} views   {100 * robot:6.2f} {100 * offline:6.2f}",
        flush=True,
    )
    return robot, offline


# --- Photographs

Views = dict[View, Picture]


def photographed(front_end: FrontEnd, picture: NDArray[np.uint8], own_ground: bool) -> NDArray[np.float32]:
    """The signature of an object: its picture at twice its size, so that the half-resolution copy is it."""
    mask = picture[:, :, 3] > 0
    shown = picture[:, :, :3] if own_ground else np.where(mask[:, :, None], picture[:, :, :3], WALL_GREY)
    frame = np.full((*FRAME_PX, 3), WALL_GREY, np.uint8)
    top, left = CORNER_PX
    large = np.kron(shown, np.ones((2, 2, 1))).astype(np.uint8)
    frame[top : top + large.shape[0], left : left + large.shape[1]] = large
    front_end.see(frame)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = (
        left + 2.0 * columns[0] - 0.5,
        top + 2.0 * rows[0] - 0.5,
        left + 2.0 * columns[-1] + 1.5,
        top + 2.0 * rows[-1] + 1.5,
    )
    signature = front_end.signature(box)
    assert signature is not None
    return signature


def apart(directions: Sequence[tuple[int, int]]) -> NDArray[np.float64]:
    """Angles between directions (degrees from above, degrees round)."""
    polar, azimuth = np.radians(np.array(directions, np.float64)).T
    units = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1
    )
    return np.arccos(np.clip(units @ units.T, -1.0, 1.0))


def split_views(directions: Sequence[tuple[int, int]], count: int, seed: int) -> tuple[list[int], list[int]]:
    """Indices to train with, each as far as can be from those before, and to test with."""
    angles = apart(directions)
    random = np.random.default_rng(seed)
    train = [int(random.integers(len(directions)))]
    while len(train) < count:
        nearest = angles[train].min(axis=0) + random.uniform(0.0, 0.02, len(directions))
        nearest[train] = -1.0
        train.append(int(nearest.argmax()))
    return train, [i for i in range(len(directions)) if angles[train, i].min() >= APART_RAD]


def photographed_all(views: Views, own_ground: bool) -> dict[tuple[str, int, int], NDArray[np.float32]]:
    """The signature of every photograph."""
    front_end = FrontEnd([load_rig("three60").cameras[1]])
    return {key: photographed(front_end, picture, own_ground) for key, picture in views.items()}


def parted(
    signatures: dict[tuple[str, int, int], NDArray[np.float32]], count: int, seed: int
) -> tuple[Signatures, Signatures]:
    """Signatures of photographs to train and to test with, by object."""
    objects = sorted({name for name, _, _ in signatures})
    directions = sorted({(polar, azimuth) for _, polar, azimuth in signatures})
    train, test = (
        {i: [signatures[name, *directions[k]] for k in part] for i, name in enumerate(objects)}
        for part in split_views(directions, count, seed)
    )
    return train, test


def measure_photographs(views: Views, count: int, own_ground: bool) -> None:
    """Prints the line of one ground: means over SPLITS choices of training views."""
    signatures = photographed_all(views, own_ground)
    parts = [parted(signatures, count, seed) for seed in range(SPLITS)]
    robot = np.mean([share_on_robot(*part) for part in parts])
    offline = np.mean([share_offline(*part) for part in parts])
    objects = len({name for name, _, _ in views})
    where = "own blue ground" if own_ground else "grey wall"
    print(f"ETH-80, {objects} objects, {where}   {100 * robot:6.2f} {100 * offline:6.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="*", default=["paper_room:1", "building50:1"], help="NAME:SEED ...")
    parser.add_argument("--views", type=int, default=10, help="training views of each beacon (default 10)")
    parser.add_argument("--photographs", action="store_true", help="ETH-80 besides")
    arguments = parser.parse_args()
    print("right names, %                     as on a robot  offline")
    shares: dict[str, list[tuple[float, float]]] = {}
    for scene in arguments.scenes:
        name, seed = scene.rsplit(":", 1)
        shares.setdefault(name, []).append(measure_scene(name, int(seed), arguments.views))
    for name, found in shares.items():
        robot, offline = np.mean(found, axis=0)
        print(f"{name}, mean of {len(found)}   {100 * robot:6.2f} {100 * offline:6.2f}")
    if arguments.photographs:
        views = read_photographs(archive_path())
        for own_ground in (False, True):
            measure_photographs(views, arguments.views, own_ground)


if __name__ == "__main__":
    main()
