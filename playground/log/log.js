"use strict";
// A log folder, strictly read, in the words of host_sim/bslam/log.py.

const LABEL_MAX = 2147483647;
const WORD_MAX = 64;
const FARTHEST = 1e6;
const ODOMETRY_COLUMNS = {
    wheels: ["left_m", "right_m"],
    ticks: ["left_ticks", "right_ticks"],
    velocity: ["v_mps", "omega_radps"],
};
const SIGHTING_OPTIONAL = [
    "beacon_id",
    "range_m",
    "mappable",
    "bearing_sd_rad",
    "range_sd_m",
    "range_scale_sd",
    "score",
    "beacon_class",
];
const NO_RANGE_ALONE = "a sighting of range alone cannot be used";
const A_WORD = `a word of up to ${WORD_MAX} printable characters`;
const IDENTITY_ALLOWED = `an integer from 0 to ${LABEL_MAX}, ${A_WORD}`;

const isCount = (value) => value >= 0 && value <= 2 ** 53 && Math.floor(value) === value;
const COUNT = { allowed: "an integer from 0 to 2^53", holds: isCount };
const NUMBER = { allowed: "a number from -1e6 to 1e6", holds: (value) => Math.abs(value) <= FARTHEST };
const COLUMN_RULES = {
    time_us: { ...COUNT, allowed: "an integer from 0 to 2^53, in microseconds" },
    left_m: NUMBER,
    right_m: NUMBER,
    left_ticks: COUNT,
    right_ticks: COUNT,
    v_mps: NUMBER,
    omega_radps: NUMBER,
    gyro_radps: {
        allowed: "a number from -1000 to 1000, or empty",
        holds: (value) => Math.abs(value) <= 1000,
        mayBeEmpty: true,
    },
    gyro_sd_radps: {
        allowed: "0 or a number from 1e-6 to 100",
        holds: (value) => value === 0 || (value >= 1e-6 && value <= 100),
    },
    beacon_id: { allowed: IDENTITY_ALLOWED, isWord: true },
    bearing_rad: {
        allowed: "radians from -2 pi to 2 pi, which are degrees times pi/180",
        holds: (value) => Math.abs(value) <= 2 * Math.PI,
        why: NO_RANGE_ALONE,
    },
    range_m: {
        allowed: "a number above 0, at most 1e6, or empty",
        holds: (value) => value > 0 && value <= FARTHEST,
        mayBeEmpty: true,
    },
    bearing_sd_rad: {
        allowed: "0 or radians from 1e-5 to pi",
        holds: (value) => value === 0 || (value >= 1e-5 && value <= Math.PI),
    },
    range_sd_m: {
        allowed: "0 or a number from 0.001 to 1e4",
        holds: (value) => value === 0 || (value >= 1e-3 && value <= 1e4),
    },
    range_scale_sd: { allowed: "a number from 0 to 1", holds: (value) => value >= 0 && value <= 1 },
    score: NUMBER,
    beacon_class: {
        allowed: "an integer from 0 to 254",
        holds: (value) => isCount(value) && value <= 254,
    },
    mappable: { allowed: "0 or 1", holds: (value) => value === 0 || value === 1 },
    x_m: NUMBER,
    y_m: NUMBER,
    theta_rad: { ...NUMBER, allowed: "a number from -1e6 to 1e6, or empty", mayBeEmpty: true },
};

/** texts: the files' contents by their names without ".gz", those that a log needs among them. Throws
 * PageError. */
function readLog(name, texts) {
    const notes = [];
    const robot = readRobot("robot.toml", texts["robot.toml"]);
    const odometry = readOdometry(texts["odometry.csv"], robot, notes);
    const seen = csvTable("sightings", texts, [["time_us", "bearing_rad"]], SIGHTING_OPTIONAL)
        .unrepeated(notes)
        .begun(notes);
    seen.requireOrder(false);
    const placed =
        "beacons.csv" in texts
            ? csvTable("beacons", texts, [["beacon_id", "x_m", "y_m"]], []).unrepeated(notes)
            : null;
    const identities = readIdentities(seen, placed);
    return {
        name,
        robot,
        odometry,
        notes,
        words: identities.words,
        sightings: sightingsOf(seen, identities.of(seen)),
        truth: "truth.csv" in texts ? readTruth(texts, notes) : null,
        beacons: placed && beaconsOf(placed, identities.of(placed)),
    };
}

function csvTable(stem, texts, layouts, optional) {
    return readTable(`${stem}.csv`, texts[`${stem}.csv`], layouts, optional, COLUMN_RULES);
}

function readOdometry(text, robot, notes) {
    const layouts = Object.values(ODOMETRY_COLUMNS).map((names) => ["time_us", ...names]);
    const optional = ["gyro_radps", "gyro_sd_radps"];
    let table = readTable("odometry.csv", text, layouts, optional, COLUMN_RULES);
    table.requireRows("allowed: at least one");
    table = table.unrepeated(notes).begun(notes);
    table.requireOrder(true);
    const [kind, names] = Object.entries(ODOMETRY_COLUMNS).find(([, [first]]) => table.has(first));
    if (kind === "ticks") {
        requireTicks(table, robot);
    }
    const [a, b] = names.map((name) => table.values[name]);
    const { time_us: timeUs, gyro_radps: gyro, gyro_sd_radps: gyroSd } = table.values;
    return { kind, timeUs, a, b, gyro, gyroSd };
}

function requireTicks(table, robot) {
    if (robot.counter_bits === undefined) {
        throw new PageError(
            `odometry.csv: ticks need ${TICK_KEYS.join(", ")} in robot.toml; allowed: all four there`,
        );
    }
    const highest = 2 ** robot.counter_bits - 1;
    const allowed = `an integer from 0 to ${highest} (robot.toml: ${robot.counter_bits} counter_bits)`;
    for (const name of ODOMETRY_COLUMNS.ticks) {
        table.require(name, (row) => table.values[name][row] <= highest, allowed);
    }
}

/** Numbers for identities: their own, or where one is a word, the place of each among the sorted ones. */
function readIdentities(seen, placed) {
    const names = new Set();
    for (const [table, orEmpty] of [
        [seen, ", or empty"],
        [placed, ""],
    ]) {
        const texts = table?.texts.beacon_id || [];
        const isGood = (row) => (texts[row] === "" ? orEmpty !== "" : isIdentity(texts[row]));
        if (texts.length) {
            table.require("beacon_id", isGood, IDENTITY_ALLOWED + orEmpty);
        }
        texts.filter((text) => text !== "").forEach((text) => names.add(identityName(text)));
    }
    const isWords = [...names].some((one) => Number.isNaN(numberOf(one)));
    const words = isWords ? [...names].sort() : [];
    const place = new Map(words.map((word, number) => [word, number]));
    const numberFor = (text) => {
        if (text === "") {
            return -1;
        }
        return isWords ? place.get(identityName(text)) : numberOf(text);
    };
    const of = (table) => (table.texts.beacon_id || table.lines.map(() => "")).map(numberFor);
    return { words, of };
}

function isIdentity(text) {
    const value = numberOf(text);
    if (!Number.isNaN(value)) {
        return isCount(value) && value <= LABEL_MAX;
    }
    return text.length <= WORD_MAX && !/\p{C}/u.test(text);
}

function identityName(text) {
    const value = numberOf(text);
    return Number.isNaN(value) ? text : String(value);
}

function identityText(log, number) {
    return number < 0 ? "" : (log.words[number] ?? String(number));
}

function sightingsOf(table, id) {
    const column = (name, otherwise) => table.values[name] || table.lines.map(() => otherwise);
    return {
        id,
        timeUs: table.values.time_us,
        bearing: table.values.bearing_rad.map(wrapRad),
        range: column("range_m", NaN),
        mappable: column("mappable", 1).map((value) => value === 1),
        bearingSd: table.values.bearing_sd_rad,
        rangeSd: table.values.range_sd_m,
        rangeScaleSd: table.values.range_scale_sd,
        score: table.values.score,
        beaconClass: table.values.beacon_class,
    };
}

function readTruth(texts, notes) {
    let table = csvTable("truth", texts, [["time_us", "x_m", "y_m"]], ["theta_rad"]);
    table.requireRows("allowed: at least one, or no such file");
    table = table.unrepeated(notes).begun(notes);
    table.requireOrder(true);
    const theta = (table.values.theta_rad || table.lines.map(() => NaN)).map(wrapRad);
    return { timeUs: table.values.time_us, x: table.values.x_m, y: table.values.y_m, theta };
}

function beaconsOf(table, id) {
    table.require("beacon_id", (row) => id.indexOf(id[row]) === row, "an identity that no row above has");
    return { id, x: table.values.x_m, y: table.values.y_m };
}
