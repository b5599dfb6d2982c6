"use strict";
// A replay held against truth.csv and beacons.csv: host_sim/bslam/evaluation/metrics.py.

/** Truth in the frame of the map, errors and NEES of each step, and what is left of the map. */
function evaluate(replay) {
    const { log, poses, timesUs } = replay;
    const isAligned = !startsAtOrigin(log);
    const truth = timesUs.map((timeUs) => log.truth && truthAt(log.truth, timeUs));
    const rows = timesUs.map((_, row) => row).filter((row) => row > 0 && truth[row]);
    const toTruth =
        isAligned && rows.length > 1
            ? fitRigid(
                  rows.map((row) => poses[row]),
                  rows.map((row) => truth[row]),
              )
            : new Rigid();
    const toMap = toTruth.inverse;
    const inMap = truth.map((pose) => (pose ? toMap.pose(pose) : { x: NaN, y: NaN, theta: NaN }));
    const errors = timesUs.map((timeUs, row) => {
        const isScored = row > 0 && truth[row] !== null;
        const error = isScored ? Math.hypot(poses[row].x - inMap[row].x, poses[row].y - inMap[row].y) : NaN;
        const hasNees = isScored && row >= NEES_FIRST_STEP && Number.isFinite(inMap[row].theta);
        const nees = hasNees ? poseNees(poses[row], inMap[row], replay.choices.filter) : NaN;
        return [1e-6 * (timeUs - timesUs[0]), error, nees];
    });
    return {
        truth: inMap,
        errors,
        isAligned,
        ...evaluateMap(replay, isAligned, rows.length > 1 ? toMap : null),
    };
}

/** The map by an alignment of its own, where identities say which beacon is which. */
function evaluateMap(replay, isAligned, toMapByPath) {
    const { log, estimator, ledger } = replay;
    const beacons = estimator.beacons();
    if (!log.beacons) {
        return { beacons, trueBeacons: [], mapError: NaN };
    }
    const known = log.beacons.id.map((id, row) => ({ id, x: log.beacons.x[row], y: log.beacons.y[row] }));
    const byId = new Map(known.map((one) => [one.id, one]));
    const pairs = beacons
        .filter((one) => one.confirmed && byId.has(ledger.identity(one.uid)))
        .map((one) => [one, byId.get(ledger.identity(one.uid))]);
    const toTruth = isAligned
        ? fitRigid(
              pairs.map(([one]) => one),
              pairs.map(([, other]) => other),
          )
        : new Rigid();
    const squares = pairs.map(([one, other]) => squaredDistance(toTruth.point(one), other));
    const mapError = Math.sqrt(squares.reduce((sum, one) => sum + one, 0) / squares.length);
    const toMap = toMapByPath || toTruth.inverse;
    return { beacons, mapError, trueBeacons: known.map((one) => ({ ...one, ...toMap.point(one) })) };
}

function squaredDistance(a, b) {
    return (a.x - b.x) ** 2 + (a.y - b.y) ** 2;
}
