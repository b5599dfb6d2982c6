"use strict";
// robot.toml: the few kinds of lines that it may have, and what each key may hold (host_sim/bslam/log.py).

const TOML_NUMBER = /^[+-]?(0|[1-9]\d*)(\.\d+)?(e[+-]?\d+)?$/i;
const TOML_WORDS = new Map([
    ["inf", Infinity],
    ["+inf", Infinity],
    ["true", true],
    ["false", false],
]);
const TICK_KEYS = ["left_radius_m", "right_radius_m", "ticks_per_revolution", "counter_bits"];

const inRange = (low, high) => ({
    allowed: `a number from ${general(low)} to ${general(high)}`,
    holds: (value) => typeof value === "number" && value >= low && value <= high,
});
const whole = (low, high) => ({
    allowed: high === undefined ? `an integer from ${low}` : `an integer from ${low} to ${high}`,
    holds: (value) => Number.isInteger(value) && value >= low && value <= (high ?? Infinity),
});

const ROBOT_RULES = {
    wheelbase_m: inRange(0.001, 10),
    wheel_speed_sigma_mps: inRange(0, 100),
    step_us: whole(1),
    field_of_view_rad: {
        allowed: "above 0, at most 6.2832 (a full turn)",
        holds: (value) => value > 0 && value <= 6.2832,
    },
    bearing_sigma_rad: inRange(0, 3.2),
    range_sigma_fraction: inRange(0, 10),
    range_sigma_scale_m: { allowed: "a number from 0.1, or inf", holds: (value) => value >= 0.1 },
    range_sigma_floor_m: inRange(0, 100),
    sensor_x_m: inRange(-100, 100),
    sensor_y_m: inRange(-100, 100),
    sensor_yaw_rad: inRange(-3.2, 3.2),
    sighting_delay_us: whole(0, 10000000),
    sighting_correlation_m: inRange(0, 100),
    sighting_scale_sd: inRange(0, 1),
    left_radius_m: inRange(0.0001, 10),
    right_radius_m: inRange(0.0001, 10),
    ticks_per_revolution: whole(1, 10000000),
    counter_bits: whole(2, 32),
    wheel_noise: {
        allowed: "'speedometer' or 'actuation'",
        holds: (value) => ["speedometer", "actuation"].includes(value),
    },
    gyro_sigma_radps: inRange(0.000001, 100),
    settings: {
        allowed: "a table of the core's settings, each a number",
        holds: (table) => typeof table === "object" && Object.values(table).every(Number.isFinite),
    },
};
const ROBOT_DEFAULTS = {
    range_sigma_floor_m: 0,
    sensor_x_m: 0,
    sensor_y_m: 0,
    sensor_yaw_rad: 0,
    sighting_delay_us: 0,
    sighting_correlation_m: 0,
    sighting_scale_sd: 0,
    wheel_noise: "speedometer",
    gyro_sigma_radps: 0.02,
    settings: {},
};
const ROBOT_REQUIRED = [
    "wheelbase_m",
    "wheel_speed_sigma_mps",
    "step_us",
    "field_of_view_rad",
    "bearing_sigma_rad",
    "range_sigma_fraction",
    "range_sigma_scale_m",
];

function readRobot(file, text) {
    const table = parseToml(file, text);
    for (const [key, value] of Object.entries(table)) {
        requireKnown(`${file}, key ${key}: no such key`, key, Object.keys(ROBOT_RULES));
        if (!ROBOT_RULES[key].holds(value)) {
            const { allowed } = ROBOT_RULES[key];
            throw new PageError(`${file}, key ${key}: ${shown(value)} is not allowed; allowed: ${allowed}`);
        }
    }
    requireKeys(file, table);
    return { ...ROBOT_DEFAULTS, ...table };
}

/** Throws PageError, which says so and what is allowed, for a name that is none of these. */
function requireKnown(said, name, allowed) {
    if (!allowed.includes(name)) {
        throw new PageError(`${said}; allowed: ${allowed.join(", ")}${didYouMean(name, allowed)}`);
    }
}

function requireKeys(file, table) {
    const [first, ...others] = ROBOT_REQUIRED.filter((key) => !(key in table));
    if (first) {
        const more = others.length ? `; also missing: ${others.join(", ")}` : "";
        throw new PageError(
            `${file}, key ${first}: is missing; allowed: ${ROBOT_RULES[first].allowed}${more}`,
        );
    }
    const absent = TICK_KEYS.filter((key) => !(key in table));
    if (absent.length > 0 && absent.length < TICK_KEYS.length) {
        throw new PageError(
            `${file}, key ${absent[0]}: is missing; allowed: all of ${TICK_KEYS.join(", ")}, or none`,
        );
    }
}

/** Lines of key = value, under [table] perhaps; of values, numbers, texts and true or false. */
function parseToml(file, text) {
    const root = Object.create(null); // else a key __proto__ would be none
    let table = root;
    linesOf(text.replace(/^\ufeff/, "")).forEach((line, index) => {
        const [, head] = line.match(/^\s*\[\s*([\w-]+)\s*\]\s*(?:#.*)?$/) || [];
        const [, key, value] = line.match(/^\s*([\w-]+)\s*=\s*(.*?)\s*$/) || [];
        if (head ? head in root : key && key in table) {
            throw tomlError(file, index + 1, line, "each key once");
        } else if (head) {
            table = root[head] = Object.create(null);
        } else if (key) {
            table[key] = tomlValue(file, index + 1, line, value);
        } else if (!/^\s*(#.*)?$/.test(line)) {
            throw tomlError(file, index + 1, line);
        }
    });
    return root;
}

function tomlValue(file, number, line, text) {
    const [, word] = text.match(/^"([^"\\]*)"\s*(?:#.*)?$/) || text.match(/^'([^']*)'\s*(?:#.*)?$/) || [];
    if (word !== undefined) {
        return word;
    }
    const bare = text.replace(/\s*#.*$/, "");
    if (TOML_WORDS.has(bare)) {
        return TOML_WORDS.get(bare);
    }
    const digits = bare.replace(/(\d)_(?=\d)/g, "$1");
    if (!TOML_NUMBER.test(digits)) {
        throw tomlError(file, number, line);
    }
    return Number(digits);
}

function tomlError(file, number, line, allowed = "lines of key = value") {
    return new PageError(`${file}: not TOML: ${quoted(line)} (line ${number}); allowed: ${allowed}`);
}
