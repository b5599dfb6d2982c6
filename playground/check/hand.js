"use strict";
// Whether a map is the mirror image of what is known of it: host_sim/bslam/logcheck/reference.py. The map is
// the estimator's own, of the log with its units and signs put right.

const PAIRS_TRIED = 3000;
const POINTS_TRIED = 200; // of a pair
const FEWEST_POINTS = 3;
const NEAR_SHARE = 0.08; // of the usual distance from the middle: a point is where it is told
const FITTING_SHARE = 0.6; // of points that must be about there
const CLEARER = 0.05; // by which one hand must fit better than the other

/** The log with its numbers multiplied; odometry that has no speeds as travel of the wheels. */
function multiplied(log, factors) {
    const { odometry, sightings } = log;
    const { way, turn } = odometryIncrements(log);
    const half = turn.map((one) => 0.5 * log.robot.wheelbase_m * factors.turn * one);
    const isVelocity = odometry.kind === "velocity";
    const isTicks = odometry.kind === "ticks";
    return {
        ...log,
        odometry: {
            kind: isVelocity ? "velocity" : "wheels",
            timeUs: isTicks ? odometry.timeUs.slice(1) : odometry.timeUs,
            a: isVelocity
                ? odometry.a.map((one) => factors.way * one)
                : way.map((one, row) => factors.way * one - half[row]),
            b: isVelocity
                ? odometry.b.map((one) => factors.turn * one)
                : way.map((one, row) => factors.way * one + half[row]),
        },
        sightings: {
            ...sightings,
            bearing: sightings.bearing.map((one) => wrapRad(factors.bearing * one)),
            range: sightings.range.map((one) => factors.range * one),
        },
    };
}

/** Map on beacons.csv, path on truth.csv: those that are there and fit in most places. */
async function fittedReferences(log, factors) {
    if (!log.beacons && !log.truth) {
        return [];
    }
    const choices = { observation: "distance", association: "known", filter: "invariant" };
    const replay = await new Replay(multiplied(log, factors), choices).run();
    const found = [];
    if (log.beacons) {
        const placeOf = new Map(
            log.beacons.id.map((id, row) => [id, { x: log.beacons.x[row], y: log.beacons.y[row] }]),
        );
        const ours = replay.estimator.beacons().filter((one) => placeOf.has(one.label));
        found.push(
            handOf(
                "beacons.csv",
                ours,
                ours.map((one) => placeOf.get(one.label)),
            ),
        );
    }
    if (log.truth) {
        const truth = replay.timesUs.map((timeUs) => truthAt(log.truth, timeUs));
        const known = truth.map((_, row) => row).filter((row) => truth[row]);
        found.push(
            handOf(
                "truth.csv",
                known.map((row) => replay.poses[row]),
                known.map((row) => truth[row]),
            ),
        );
    }
    return found.filter((one) => one !== null);
}

/** Which hand fits; null where points are too few, in one place, or do not agree. */
function handOf(what, estimate, reference) {
    const isOnePlace = (points) => points.every(({ x, y }) => x === points[0].x && y === points[0].y);
    if (estimate.length < FEWEST_POINTS || isOnePlace(estimate) || isOnePlace(reference)) {
        return null;
    }
    const middle = { x: median(reference.map(({ x }) => x)), y: median(reference.map(({ y }) => y)) };
    const near = NEAR_SHARE * median(reference.map((one) => Math.sqrt(squaredDistance(one, middle))));
    const [plain, mirrored] = [1, -1].map((sign) => {
        const placed = placedOn(
            estimate.map(({ x, y }) => ({ x, y: sign * y })),
            reference,
            near,
        );
        const off = placed.map((one, row) => Math.sqrt(squaredDistance(one, reference[row])) / near);
        return { cost: cappedMean(off), share: off.filter((one) => one < 3).length / off.length };
    });
    const best = plain.cost <= mirrored.cost ? plain : mirrored;
    const isClear = Math.abs(plain.cost - mirrored.cost) >= CLEARER && best.share >= FITTING_SHARE;
    return isClear ? { what, isMirrored: best === mirrored } : null;
}

function cappedMean(values) {
    return sumOf(values.map((value) => Math.min(value, 3))) / values.length;
}

/** The points where most of them are near the reference: by the best of many pairs, then by all. */
function placedOn(points, reference, near) {
    const every = 1 + Math.floor(points.length / POINTS_TRIED);
    const some = points.map((_, row) => row).filter((row) => row % every === 0);
    let [best, least] = [{ a: 1, b: 0, x: 0, y: 0 }, Infinity];
    for (const [i, j] of pairsOf(points.length)) {
        const move = similarityOf(points[i], points[j], reference[i], reference[j]);
        const off = some.map(
            (row) => Math.sqrt(squaredDistance(moved(move, points[row]), reference[row])) / near,
        );
        const cost = move ? cappedMean(off) : Infinity;
        [best, least] = cost < least ? [move, cost] : [best, least];
    }
    for (let round = 0; round < 10; round++) {
        best = weightedSimilarity(best, points, reference, near);
    }
    return points.map((point) => moved(best, point));
}

/** All pairs of so many points, or a sample of them. */
function pairsOf(count) {
    if ((count * (count - 1)) / 2 <= PAIRS_TRIED) {
        return Array.from({ length: count }, (_, i) => i).flatMap((i) =>
            Array.from({ length: count - i - 1 }, (_, j) => [i, i + 1 + j]),
        );
    }
    const random = new Random(0);
    const one = () => Math.floor(random.uniform(0, count));
    return Array.from({ length: PAIRS_TRIED }, () => [one(), one()]).filter(([i, j]) => i !== j);
}

/** p -> (a p.x - b p.y + x, b p.x + a p.y + y): turned, scaled and shifted. */
function moved({ a, b, x, y }, point) {
    return { x: a * point.x - b * point.y + x, y: b * point.x + a * point.y + y };
}

/** What brings p on u and q on v. */
function similarityOf(p, q, u, v) {
    const [px, py, ux, uy] = [p.x - q.x, p.y - q.y, u.x - v.x, u.y - v.y];
    const square = Math.max(px * px + py * py, 1e-12);
    return shifted((px * ux + py * uy) / square, (px * uy - py * ux) / square, p, u);
}

/** Turned and scaled by a, b, with `from` brought on `to`. */
function shifted(a, b, from, to) {
    const there = moved({ a, b, x: 0, y: 0 }, from);
    return { a, b, x: to.x - there.x, y: to.y - there.y };
}

/** The best for all points, those far off counting less. */
function weightedSimilarity(move, points, reference, near) {
    const weights = points.map(
        (point, row) => 1 / (1 + squaredDistance(moved(move, point), reference[row]) / near ** 2),
    );
    const total = sumOf(weights);
    const mean = (of) => ({
        x: sumOf(of.map((one, row) => weights[row] * one.x)) / total,
        y: sumOf(of.map((one, row) => weights[row] * one.y)) / total,
    });
    const [from, to] = [mean(points), mean(reference)];
    let [along, across, square] = [0, 0, 0];
    points.forEach((point, row) => {
        const [px, py] = [point.x - from.x, point.y - from.y];
        const [qx, qy] = [reference[row].x - to.x, reference[row].y - to.y];
        along += weights[row] * (px * qx + py * qy);
        across += weights[row] * (px * qy - py * qx);
        square += weights[row] * (px * px + py * py);
    });
    return shifted(along / square, across / square, from, to);
}
