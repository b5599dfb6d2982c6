"use strict";
// True poses at the times of the steps, and what odometry says of each: host_sim/bslam/evaluation/truth.py.

const INTERPOLATE_US = 500000;
const NEAR_US = 50000;
const START_WINDOW_US = 4000000;

/** The first place at which `values`, which rise, are not below `value`. */
function searchSorted(values, value) {
    let [low, high] = [0, values.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        [low, high] = values[middle] < value ? [middle + 1, high] : [low, middle];
    }
    return low;
}

/** The value at this share of the way to the place `after`. */
function between(values, after, share) {
    return values[after - 1] + share * (values[after] - values[after - 1]);
}

/** The true pose at a time; null where nobody knows it. theta may be NaN. */
function truthAt(truth, timeUs) {
    const stamps = truth.timeUs;
    const after = Math.min(Math.max(searchSorted(stamps, timeUs), 1), stamps.length - 1);
    const before = Math.max(after - 1, 0);
    const isInside = timeUs >= stamps[before] && timeUs <= stamps[after];
    const toBefore = Math.abs(timeUs - stamps[before]);
    const toAfter = Math.abs(timeUs - stamps[after]);
    if (isInside && stamps[after] - stamps[before] <= INTERPOLATE_US && after > before) {
        return poseBetween(truth, after, toBefore / (stamps[after] - stamps[before]));
    }
    const row = toBefore <= toAfter ? before : after;
    const isNear = Math.min(toBefore, toAfter) <= NEAR_US;
    return isNear ? { x: truth.x[row], y: truth.y[row], theta: truth.theta[row] } : null;
}

function poseBetween(truth, after, share) {
    const turn = wrapRad(truth.theta[after] - truth.theta[after - 1]);
    return {
        x: between(truth.x, after, share),
        y: between(truth.y, after, share),
        theta: wrapRad(truth.theta[after - 1] + share * turn),
    };
}

/** Times of the start and of the end of each step. */
function stepTimesUs(log) {
    const times = log.odometry.timeUs;
    return log.odometry.kind === "wheels" ? [wheelsStartUs(log), ...times] : times;
}

/** A step before the first row, or the last image or true pose before that, if any is near. */
function wheelsStartUs(log) {
    const firstUs = log.odometry.timeUs[0];
    const latestUs = Math.max(firstUs - usualStepUs(log), 0);
    const seenUs = [...log.sightings.timeUs, ...(log.truth ? log.truth.timeUs : [])];
    const near = seenUs.filter((time) => time <= latestUs && time >= firstUs - START_WINDOW_US);
    return near.reduce((latest, time) => Math.max(latest, time), near.length ? near[0] : latestUs);
}

function usualStepUs(log) {
    const times = log.odometry.timeUs;
    const usualUs = times.length > 1 ? Math.trunc(median(differences(times))) : 0;
    return usualUs > 1.5 * log.robot.step_us ? usualUs : log.robot.step_us;
}

function startsAtOrigin(log) {
    const pose = log.truth && truthAt(log.truth, stepTimesUs(log)[0]);
    return Boolean(pose) && [pose.x, pose.y, pose.theta].every((value) => Math.abs(value) <= 1e-6);
}

/** Way along the path, m, and turn, rad, of each step. */
function odometryIncrements(log) {
    const { kind, timeUs, a, b } = log.odometry;
    if (kind === "velocity") {
        const rows = differences(timeUs).map((step, row) => [1e-6 * step, row + 1]);
        return { way: rows.map(([dt, row]) => a[row] * dt), turn: rows.map(([dt, row]) => b[row] * dt) };
    }
    const isTicks = kind === "ticks";
    const left = isTicks ? travelOfTicks(a, log.robot.left_radius_m, log.robot) : a;
    const right = isTicks ? travelOfTicks(b, log.robot.right_radius_m, log.robot) : b;
    return {
        way: left.map((one, row) => 0.5 * (one + right[row])),
        turn: left.map((one, row) => (right[row] - one) / log.robot.wheelbase_m),
    };
}

function travelOfTicks(ticks, radiusM, robot) {
    const modulus = 2 ** robot.counter_bits;
    const perTick = (2 * Math.PI * radiusM) / robot.ticks_per_revolution;
    return differences(ticks).map(
        (step) => (floorMod(step + 0.5 * modulus, modulus) - 0.5 * modulus) * perTick,
    );
}

/** Poses of odometry alone, from the origin. */
function deadReckoning(log) {
    const { way, turn } = odometryIncrements(log);
    const poses = [{ x: 0, y: 0, theta: 0 }];
    way.forEach((forward, row) => poses.push(afterArc(poses[row], forward, turn[row])));
    return poses;
}
