"use strict";
// Units and signs, told by a table of slips: host_sim/bslam/logcheck/units.py.

const UNITS = { millimetres: 1e-3, centimetres: 1e-2, inches: 0.0254, feet: 0.3048 };
const DEGREE = Math.PI / 180;
const GROSS = Math.log(2.2); // a factor beyond it is of a unit
const SAME = Math.log(1.45); // a factor so near to a slip's is that slip's
const SURE_ERRORS = 5;
const FASTEST_MPS = 30;
const SPEEDS = "odometry.csv: left_m and right_m are speeds, m/s";
const ROWS_MIN = 20; // of odometry
const LEFT_SHARE = 0.8; // of the spread that rows as told leave

/** Whether only a wrong unit can be so far off. */
function isGross(factor) {
    return Math.abs(Math.log(factor)) > GROSS;
}

/** The slip of units that explains most of the flow, as factors and a finding; null if it needs none. */
function unitSlip(log, drive, flow) {
    const costs = unitSlips(log, drive.rowS).map((slip) => [sumOf(misfits(slip.factors, flow)), slip]);
    const [, best] = costs.reduce((least, one) => (one[0] < least[0] ? one : least));
    const [way, turn] = [flow.way, flow.turn].map((factor) => general(factor, 4));
    let sure = `sightings show ${way} of odometry's way and ${turn} of its turn`;
    if (isMended(best.factors, flow)) {
        return slipFinding(best, sure);
    }
    if (log.odometry.kind !== "velocity" || drive.speedMps <= FASTEST_MPS) {
        return null;
    }
    sure += `; as told it drives ${drive.speedMps.toFixed(0)} m/s`;
    const what = "v_mps and range_m are in millimetres";
    const factors = { ...NO_FACTORS, way: 1e-3, range: 1e-3 };
    return slipFinding({ kind: "units", what, columns: "v_mps and range_m", factors }, sure);
}

/** Odometry that is as much off in its way as in its turn, by no unit's factor. */
function unknownUnit(log, flow) {
    const { kind } = log.odometry;
    const [way, turn] = [Math.abs(flow.way), Math.abs(flow.turn)];
    const most = Number.isFinite(flow.turnMost) ? Math.abs(flow.turnMost) : turn;
    const isBoth = Math.log(Math.min(turn, most) / way) < SAME && Math.log(way / Math.max(turn, most)) < SAME;
    if (kind === "velocity" || !(way > 0 && turn > 0 && isGross(way) && isGross(turn) && isBoth)) {
        return [];
    }
    const columns = kind === "ticks" ? "left_ticks and right_ticks" : "left_m and right_m";
    const large = `about ${general(1 / way, 3)} times too large, and in no unit that is known`;
    const [ofWay, ofTurn] = [flow.way, flow.turn].map((factor) => general(factor, 3));
    return [
        {
            kind: "units",
            what: `odometry: ${columns} are ${large}`,
            sure: `sightings show ${ofWay} of odometry's way and ${ofTurn} of its turn`,
            mend:
                kind === "ticks"
                    ? "mend ticks_per_revolution, left_radius_m and right_radius_m of robot.toml"
                    : "write metres; counters as left_ticks, right_ticks, with the four keys of robot.toml",
        },
    ];
}

/** Wheel travel that counts from the start, and not from the row before. */
function summedUp(log) {
    const o = log.odometry;
    if (o.kind !== "wheels" || o.a.length < ROWS_MIN || Math.max(growth(o.a), growth(o.b)) < ROWS_MIN) {
        return [];
    }
    const travel = [o.a, o.b].map((sums) => Float64Array.from([0, ...differences(sums)]));
    const [told, mended] = [o, { ...o, a: travel[0], b: travel[1] }].map((odometry) =>
        bestFlow(new CheckedDrive({ ...log, odometry }, NO_FACTORS)),
    );
    const isClearer = told && mended && mended.spread < LEFT_SHARE * told.spread;
    if (!isClearer || !isGross(Math.max(Math.abs(told.way), 1e-9))) {
        return [];
    }
    const share = (mended.spread / told.spread).toFixed(2);
    return [
        {
            kind: "units",
            what: "odometry.csv: left_m and right_m are sums since the start",
            sure: `differences from row to row leave ${share} of what they leave of the sightings' motion`,
            mend: "write the travel since the row before; or counters as left_ticks and right_ticks",
        },
    ];
}

/** The largest of these, in usual steps. */
function growth(values) {
    const steps = differences(values).map(Math.abs);
    const most = values.reduce((largest, one) => Math.max(largest, Math.abs(one)), 0);
    return most / (sumOf(steps) / steps.length + 1e-12);
}

function slipFinding({ kind, what, columns, factors }, sure) {
    const factor = Object.values(factors).find((one) => one !== 1);
    return { factors, finding: { kind, what, sure, mend: `multiply ${columns} by ${general(factor)}` } };
}

function isMended(factors, flow) {
    const before = misfits(NO_FACTORS, flow);
    const after = misfits(factors, flow);
    const changed = after.filter((one, place) => one !== before[place]);
    return sumOf(before) - sumOf(after) > GROSS && Math.max(...changed) < SAME;
}

function sumOf(values) {
    return values.reduce((sum, value) => sum + value, 0);
}

function unitSlips(log, rowS) {
    const { kind } = log.odometry;
    const columns = (kind === "ticks" ? ["left_radius_m", "right_radius_m"] : ODOMETRY_COLUMNS[kind]).join(
        " and ",
    );
    const both = `${columns} and range_m`;
    const slip = (slipKind, what, names, factors) => ({
        kind: slipKind,
        what,
        columns: names,
        factors: { ...NO_FACTORS, ...factors },
    });
    const slips = Object.entries(UNITS).flatMap(([name, unit]) => [
        slip("units", `sightings.csv: range_m is in ${name}`, "range_m", { range: unit }),
        ...(kind === "velocity"
            ? [slip("units", `odometry.csv: v_mps is in ${name}`, "v_mps", { way: unit })]
            : [
                  slip("units", `odometry: ${columns} are in ${name}`, columns, { way: unit, turn: unit }),
                  slip("units", `odometry and sightings: ${both} are in ${name}`, both, {
                      way: unit,
                      turn: unit,
                      range: unit,
                  }),
                  ...(kind === "wheels" ? [slip("units", SPEEDS, columns, { way: rowS, turn: rowS })] : []),
                  slip("units", `robot.toml: wheelbase_m is in ${name}`, "wheelbase_m", { turn: 1 / unit }),
              ]),
    ]);
    if (kind === "velocity") {
        slips.push(
            slip("degrees", "odometry.csv: omega_radps is in degrees", "omega_radps", { turn: DEGREE }),
        );
        slips.push(
            slip("stamps", "odometry.csv: time_us is in milliseconds", "time_us", { way: 1e3, turn: 1e3 }),
        );
    }
    return slips;
}

/** How far way and turn of the flow are, as logarithms, from what these factors would mend. */
function misfits(factors, flow) {
    const turns = [flow.turn, flow.turnMost]
        .filter((one) => Number.isFinite(one) && one !== 0)
        .map(Math.abs)
        .sort((a, b) => a - b);
    const nearest = Math.min(Math.max(factors.turn, turns[0]), turns[turns.length - 1]);
    const turn = turns.length ? nearest / factors.turn : 1;
    const hasWay = Number.isFinite(flow.way) && flow.way !== 0;
    const way = hasWay ? (Math.abs(flow.way) * factors.range) / factors.way : 1;
    return [Math.abs(Math.log(way)), Math.abs(Math.log(turn))];
}

/** -1 for what runs against the sightings, without a doubt. */
function signsOf(flow) {
    return {
        ...NO_FACTORS,
        way: flow.way < -SURE_ERRORS * flow.wayError ? -1 : 1,
        turn: flow.turn < -SURE_ERRORS * flow.turnError ? -1 : 1,
    };
}

/** Whose sign is wrong. Mirrored bearings and swapped wheels look alike but for the hand of the map. */
function signFindings(log, signed, flow, fitted) {
    const isOneHand = new Set(fitted.map((one) => one.isMirrored)).size === 1;
    const isMirrored = isOneHand && fitted[0].isMirrored;
    const words = signWords(log);
    let sure = signEvidence(flow, isOneHand ? fitted[0] : null);
    const turns = signed.way === 1 && signed.turn === -1;
    let found = words[`${signed.way},${signed.turn}`];
    if (turns && !isOneHand) {
        found = words.either;
    } else if (turns && isMirrored) {
        found = ["mirrored bearings", "bearings are mirrored", words.mirror];
    } else if (!found && isMirrored) {
        const file = fitted[0].what;
        sure = `the map fits ${file} mirrored`;
        found = [
            "mirrored bearings",
            `${file} is mirrored, or both bearings and wheels are`,
            `multiply y_m of ${file} by -1; or ${words.mirror}, and ${words.swap}`,
        ];
    }
    return found ? [{ kind: found[0], what: found[1], sure, mend: found[2] }] : [];
}

function signWords(log) {
    const [a, b] = ODOMETRY_COLUMNS[log.odometry.kind];
    const isVelocity = log.odometry.kind === "velocity";
    const swap = isVelocity ? `multiply ${b} by -1` : `exchange the columns ${a} and ${b}`;
    const mirror = "multiply bearing_rad of sightings.csv by -1";
    const swapped = isVelocity ? "the turn has the wrong sign" : "left and right wheel are swapped";
    return {
        swap,
        mirror,
        "-1,-1": ["swapped wheels", "odometry runs backward", "change the sign of odometry"],
        "-1,1": ["mount", "the sensor looks backward", "turn sensor_yaw_rad of robot.toml by pi"],
        "1,-1": ["swapped wheels", swapped, swap],
        either: ["mirrored bearings", `bearings are mirrored, or ${swapped}`, `${mirror}; or ${swap}`],
    };
}

function signEvidence(flow, fitted) {
    const [left, right] = [1, -1].map(
        (sign) =>
            sumOf(flow.shifted.map((one, row) => Math.abs(one + sign * flow.turned[row]))) /
            flow.shifted.length,
    );
    const by = fitted
        ? `; with that, the map fits ${fitted.what} ${fitted.isMirrored ? "mirrored" : "unmirrored"}`
        : "; no beacons.csv or truth.csv tells which";
    return (
        `bearings show ${flow.turn.toFixed(3)} +- ${flow.turnError.toFixed(3)} of odometry's turn; ` +
        `they are off by ${left.toFixed(4)} rad on average as told, ` +
        `by ${right.toFixed(4)} with the sign changed${by}`
    );
}
