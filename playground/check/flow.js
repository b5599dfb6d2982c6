"use strict";
// How sightings move while the robot does: signs, gross factors and the delay, without a map and without a
// start. From one sighting of a beacon to its next, the distance shrinks by the way times the bearing's
// cosine, and the bearing falls by the turn. The same as host_sim/bslam/logcheck/drive.py and flow.py.

const SIGHTINGS_MIN = 4; // of a beacon
const LAGS_S = [0.4, 1.2];
const LONGEST_LAGS = 2.5;
const DELAYS_S = Array.from({ length: 45 }, (_, index) => -0.6 + 0.05 * index);
const FLOW_ROUNDS = 12;
const PAIRS_MIN = 20;
const PAIRS_MAX = 6000;
const DELAY_GAIN = 0.03; // a delay other than the told one must explain so much more
const NO_FACTORS = { way: 1, turn: 1, bearing: 1, range: 1 };

/** What numbers are to be multiplied by, two such together. */
function together(one, other) {
    return Object.fromEntries(Object.keys(NO_FACTORS).map((key) => [key, one[key] * other[key]]));
}

/** A log as its check looks at it: way and turn up to any moment, and the sightings with an identity. */
class CheckedDrive {
    constructor(log, factors) {
        this.robot = log.robot;
        const startUs = log.odometry.timeUs[0];
        this.timeS = stepTimesUs(log).map((time) => 1e-6 * (time - startUs));
        const { way, turn } = odometryIncrements(log);
        this.wayM = summed(way).map((one) => factors.way * one);
        this.turnRad = summed(turn).map((one) => factors.turn * one);
        this.rowS = median(differences(this.timeS));
        this.delayS = 1e-6 * toldDelayUs(log);
        this.isCommanded = log.odometry.kind === "velocity";
        this.takeSightings(log, factors, startUs);
    }

    takeSightings(log, factors, startUs) {
        const s = log.sightings;
        const timeS = s.timeUs.map((time) => 1e-6 * (time - startUs));
        const hasAny = s.range.some(Number.isFinite);
        const last = this.timeS[this.timeS.length - 1];
        const isGood = (row) =>
            s.id[row] >= 0 &&
            s.mappable[row] &&
            (Number.isFinite(s.range[row]) || !hasAny) &&
            timeS[row] >= this.timeS[0] &&
            timeS[row] <= last;
        const good = timeS.map((_, row) => row).filter(isGood);
        const counts = new Map();
        good.forEach((row) => counts.set(s.id[row], (counts.get(s.id[row]) || 0) + 1));
        const rows = good.filter((row) => counts.get(s.id[row]) >= SIGHTINGS_MIN);
        const yaw = log.robot.sensor_yaw_rad;
        this.ids = rows.map((row) => s.id[row]);
        this.seenS = rows.map((row) => timeS[row]);
        this.bearing = rows.map((row) => wrapRad(factors.bearing * s.bearing[row] + yaw));
        this.range = rows.map((row) => factors.range * s.range[row]);
        this.hasRanges = this.range.every(Number.isFinite);
    }

    /** It moves, and something is seen meanwhile. */
    get isUsable() {
        return this.ids.length > 0 && this.timeS.length > 2 && extent(this.seenS) > 0;
    }

    /** Way and turn up to the moment of each sighting, which come in order of time, less a delay. */
    sumsAt(delayS) {
        const [way, turn] = [new Float64Array(this.seenS.length), new Float64Array(this.seenS.length)];
        const last = this.timeS.length - 1;
        let after = 1;
        this.seenS.forEach((seenS, row) => {
            while (after < last && this.timeS[after] < seenS - delayS) {
                after++;
            }
            const step = this.timeS[after] - this.timeS[after - 1];
            const share = Math.min(Math.max((seenS - delayS - this.timeS[after - 1]) / step, 0), 1);
            way[row] = between(this.wayM, after, share);
            turn[row] = between(this.turnRad, after, share);
        });
        return { way, turn };
    }

    /** The usual speed while it drives. */
    get speedMps() {
        const steps = differences(this.timeS);
        const speeds = differences(this.wayM).map((way, row) => Math.abs(way / steps[row]));
        const fastest = speeds.reduce((most, one) => Math.max(most, one), 0);
        const moving = speeds.filter((one) => one > 0.1 * fastest);
        return moving.length ? median(moving) : 0;
    }
}

function summed(values) {
    let sum = 0;
    return [0, ...values.map((value) => (sum += value))];
}

function toldDelayUs(log) {
    const choices = { observation: "distance", association: "known", filter: "invariant" };
    return coreSettings(new Estimator(), log, choices).sighting_delay_us;
}

/** The flow at the delay that explains most; null where too few beacons are seen again soon. */
function bestFlow(drive) {
    const pairs = sightingPairs(drive);
    const { way, turn } = drive.sumsAt(0);
    const moves = way.some((one, row) => one !== way[0] || turn[row] !== turn[0]);
    if (pairs.length < PAIRS_MIN || !moves) {
        return null;
    }
    const told = flowAt(drive, pairs, drive.delayS);
    const flows = DELAYS_S.map((delayS) => flowAt(drive, pairs, delayS));
    const best = flows.reduce((least, flow) => (flow.spread < least.spread ? flow : least));
    const chosen = best.spread < told.spread * (1 - DELAY_GAIN) ? best : told;
    return { ...chosen, spreads: flows.map((flow) => flow.spread) };
}

/** Sightings of one beacon, a lag apart. */
function sightingPairs(drive) {
    const rowsOf = new Map();
    drive.ids.forEach((id, row) => (rowsOf.get(id) || rowsOf.set(id, []).get(id)).push(row));
    const pairs = [];
    for (const id of [...rowsOf.keys()].sort((a, b) => a - b)) {
        const rows = rowsOf.get(id);
        const times = rows.map((row) => drive.seenS[row]);
        for (const lagS of LAGS_S.map((lag) => Math.max(lag, 2 * drive.rowS))) {
            times.forEach((time, place) => {
                const later = searchSorted(times, time + lagS);
                if (later < rows.length && times[later] - time <= LONGEST_LAGS * lagS) {
                    pairs.push([rows[place], rows[later]]);
                }
            });
        }
    }
    const every = 1 + Math.floor(pairs.length / PAIRS_MAX);
    return pairs.filter((_, index) => index % every === 0);
}

/** Factors of way and turn at that delay: rows of equations for changes of bearings and of ranges. */
function flowAt(drive, pairs, delayS) {
    const bearings = { byWay: [], byTurn: [], change: [] };
    const ranges = { byWay: [], byTurn: [], change: [] };
    const turned = [];
    const sums = drive.sumsAt(delayS);
    const { sensor_x_m: x, sensor_y_m: y } = drive.robot;
    for (const [i, j] of pairs) {
        const [way, turn] = [sums.way[j] - sums.way[i], sums.turn[j] - sums.turn[i]];
        const shift = wrapRad(drive.bearing[j] - drive.bearing[i]);
        const middle = drive.bearing[i] + 0.5 * shift;
        const [cos, sin] = [Math.cos(middle), Math.sin(middle)];
        const nearness = drive.hasRanges ? 2 / (drive.range[i] + drive.range[j]) : 0; // else as if far away
        addEquation(bearings, nearness * sin * way, -turn * (1 + nearness * (x * cos + y * sin)), shift);
        if (drive.hasRanges) {
            addEquation(ranges, -cos * way, turn * (y * cos - x * sin), drive.range[j] - drive.range[i]);
        }
        turned.push(turn);
    }
    const fit = robustFit(drive.hasRanges ? [bearings, ranges] : [bearings]);
    const wayFactor = Number.isFinite(fit.factors[0]) ? fit.factors[0] : 0;
    const shifted = bearings.change.map((change, row) => change - bearings.byWay[row] * wayFactor);
    return {
        way: fit.factors[0],
        turn: fit.factors[1],
        wayError: fit.errors[0],
        turnError: fit.errors[1],
        turnMost: mostTurn(bearings.byTurn, shifted),
        delayS,
        spread: fit.spread,
        turned,
        shifted,
    };
}

function addEquation(group, byWay, byTurn, change) {
    group.byWay.push(byWay);
    group.byTurn.push(byTurn);
    group.change.push(change);
}

/** The turn's factor if all of the scatter were odometry's. */
function mostTurn(byTurn, left) {
    const mean = left.reduce((sum, one) => sum + Math.abs(one), 0) / left.length;
    let [above, below] = [0, 0];
    left.forEach((one, row) => {
        const weight = 1 / Math.max(Math.abs(one), mean + 1e-12);
        above += weight * one * one;
        below += weight * byTurn[row] * one;
    });
    return below === 0 ? NaN : above / below;
}

/** Both factors, their standard errors, and the spread; each group in units of its own scatter. */
function robustFit(groups) {
    const isFree = ["byWay", "byTurn"].map((name) =>
        groups.some((group) => group[name].some((one) => one !== 0)),
    );
    let left = groups.map((group) => group.change);
    let factors = [NaN, NaN];
    let square = null;
    let scatter = [];
    for (let round = 0; round < FLOW_ROUNDS; round++) {
        scatter = left.map(
            (values) => values.reduce((sum, one) => sum + Math.abs(one), 0) / values.length + 1e-12,
        );
        square = normalEquations(groups, left, scatter, isFree);
        factors = solve2(square, isFree);
        const used = factors.map((factor, column) => (isFree[column] ? factor : 0));
        left = groups.map((group) =>
            group.change.map(
                (change, row) => change - group.byWay[row] * used[0] - group.byTurn[row] * used[1],
            ),
        );
    }
    const spread = Math.exp(scatter.reduce((sum, one) => sum + Math.log(one), 0) / scatter.length);
    return { factors, errors: standardErrors2(square, isFree), spread };
}

function normalEquations(groups, left, scatter, isFree) {
    const sums = { ww: 1e-12, wt: 0, tt: 1e-12, wv: 0, tv: 0 };
    groups.forEach((group, place) => {
        const size = scatter[place];
        group.change.forEach((change, row) => {
            const weight = 1 / (size * Math.sqrt(Math.max(Math.abs(left[place][row]) / size, 0.1)));
            const way = isFree[0] ? weight * group.byWay[row] : 0;
            const turn = isFree[1] ? weight * group.byTurn[row] : 0;
            sums.ww += way * way;
            sums.wt += way * turn;
            sums.tt += turn * turn;
            sums.wv += way * weight * change;
            sums.tv += turn * weight * change;
        });
    });
    return sums;
}

function solve2({ ww, wt, tt, wv, tv }, isFree) {
    const determinant = ww * tt - wt * wt;
    const found = [(tt * wv - wt * tv) / determinant, (ww * tv - wt * wv) / determinant];
    return found.map((factor, column) => (isFree[column] ? factor : NaN));
}

function standardErrors2({ ww, wt, tt }, isFree) {
    const determinant = ww * tt - wt * wt;
    return [tt, ww].map((other, column) => (isFree[column] ? Math.sqrt(other / determinant) : NaN));
}
