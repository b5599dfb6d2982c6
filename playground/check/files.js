"use strict";
// The files as they stand, before the strict reader: stamps, and directions in degrees. What is found is put
// right in a copy, so that the rest can be tested: host_sim/bslam/logcheck/files.py.

const STEMS = ["odometry", "sightings", "truth"];
const GAP_S = 1;
const GAP_ROWS = 8;
const TIME_UNITS = [
    [1e3, "milliseconds"],
    [1e6, "seconds"],
    [1e-3, "nanoseconds"],
]; // by what makes them us
const DEGREES_SHARE = 0.1;
const SAME_UNIT = 30; // an interval that is less than so many times off is of the same unit

/** A file of rows with stamps, its fields as texts. */
class RawTable {
    constructor(file, names, rows) {
        Object.assign(this, { file, names, rows });
    }

    /** null for another file: the strict reader says best what is wrong there. */
    static read(file, text) {
        const [names, ...rows] = linesOf(text).map(fieldsOf);
        const trimmed = (names || []).map((name) => name.trim());
        if (
            !trimmed.includes("time_us") ||
            rows.length < 2 ||
            rows.some((row) => row.length !== names.length)
        ) {
            return null;
        }
        const table = new RawTable(file, trimmed, rows);
        return table.column("time_us").every(Number.isFinite) ? table : null;
    }

    column(name) {
        const place = this.names.indexOf(name);
        return this.rows.map((row) => numberOf(row[place].trim()));
    }

    multiply(name, factor) {
        const place = this.names.indexOf(name);
        this.column(name).forEach((value, row) => {
            const product = factor * value;
            this.rows[row][place] = String(name === "time_us" ? Math.round(product) : product);
        });
    }

    get text() {
        const field = (text) => (/[",]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
        return [this.names, ...this.rows].map((row) => row.map(field).join()).join("\n") + "\n";
    }
}

/** Findings of the files; `texts` becomes what they are with these put right. */
function checkFiles(texts) {
    const stepUs = parseToml("robot.toml", texts["robot.toml"]).step_us;
    const findings = [];
    let span = null; // of odometry
    for (const file of STEMS.map((stem) => `${stem}.csv`)) {
        const table = file in texts ? RawTable.read(file, texts[file]) : null;
        if (!table) {
            continue;
        }
        const isOdometry = file === "odometry.csv";
        const found = isOdometry ? unitByInterval(table, stepUs) : unitBySpan(table, span);
        found.push(...stampFindings(table, isOdometry));
        if (table.names.includes("bearing_rad")) {
            found.push(...fileDegrees(table));
        }
        if (isOdometry) {
            const times = table.column("time_us");
            span = [times[0], times[times.length - 1]];
        }
        if (found.length) {
            texts[file] = table.text;
        }
        findings.push(...found);
    }
    return findings;
}

/** Odometry whose rows are not step_us apart, but would be in another unit. */
function unitByInterval(table, stepUs) {
    if (!(stepUs > 0)) {
        return [];
    }
    const times = [...new Set(table.column("time_us"))].sort((a, b) => a - b);
    const interval = median(differences(times));
    if (interval / stepUs > 1 / SAME_UNIT && interval / stepUs < SAME_UNIT) {
        return [];
    }
    const sure = `stamps are ${general(interval)} apart, and robot.toml has step_us = ${stepUs}`;
    const fits = ([factor]) => factor * interval > 0.3 * stepUs && factor * interval < 3 * stepUs;
    return otherUnit(table, sure, TIME_UNITS.filter(fits));
}

/** Stamps outside of the odometry's, or all within a moment of them, but not so in another unit. */
function unitBySpan(table, span) {
    const times = table.column("time_us");
    if (!span || shareOfSpan(times, span) > 0.01) {
        return [];
    }
    const last = times[times.length - 1];
    const sure = `stamps end at ${general(last, 16)}, those of odometry at ${general(span[1], 16)}`;
    const fits = ([factor]) =>
        shareOfSpan(
            times.map((time) => factor * time),
            span,
        ) > 0.2;
    return otherUnit(table, sure, TIME_UNITS.filter(fits));
}

function otherUnit(table, sure, fitting) {
    if (!fitting.length) {
        return [];
    }
    const [[factor, unit]] = fitting;
    table.multiply("time_us", factor);
    const what = `${table.file}: time_us is in ${unit}`;
    return [{ kind: "stamps", what, sure, mend: `multiply time_us of ${table.file} by ${general(factor)}` }];
}

/** Of the span that stamps cover, if most of them lie in it. */
function shareOfSpan(times, [first, last]) {
    const room = 0.05 * Math.abs(last - first);
    const inside = times.filter((time) => time >= first - room && time <= last + room);
    return inside.length > 0.7 * times.length && last > first ? extent(inside) / (last - first) : 0;
}

function extent(values) {
    const lowest = values.reduce((low, value) => Math.min(low, value), Infinity);
    return values.reduce((high, value) => Math.max(high, value), -Infinity) - lowest;
}

/** Rows that come again, run back, or are missing. */
function stampFindings(table, isOdometry) {
    const times = table.column("time_us");
    const known = new Set();
    const repeated = table.rows.map((row, index) => {
        const isNew = !known.has(row.join()) && Boolean(known.add(row.join()));
        return !isNew || (isOdometry && times[index] === times[index - 1]);
    });
    const back = times.map((time, row) => row > 0 && time < times[row - 1]);
    const { file } = table;
    const findings = [
        ...rowsFinding(file, repeated, "come again", `delete the repeated rows of ${file}`),
        ...rowsFinding(
            file,
            back,
            "run back in time",
            `sort ${file} by time_us, or cut it where the clock begins again`,
        ),
    ];
    if (findings.length) {
        const order = times.map((_, row) => row).sort((a, b) => times[a] - times[b] || a - b);
        table.rows = order.filter((row) => !repeated[row]).map((row) => table.rows[row]);
    }
    return isOdometry ? [...findings, ...gapFindings(table)] : findings;
}

function rowsFinding(file, marked, word, mend) {
    const count = marked.filter(Boolean).length;
    const what = `${file}: ${count} of ${marked.length} rows ${word}`;
    return count
        ? [{ kind: "stamps", what, sure: `the first in line ${marked.indexOf(true) + 2}`, mend }]
        : [];
}

function gapFindings(table) {
    const intervals = differences(table.column("time_us").map((time) => 1e-6 * time));
    const usual = intervals.length ? median(intervals) : 0;
    const gaps = intervals.filter((one) => one > Math.max(GAP_S, GAP_ROWS * usual));
    if (!gaps.length) {
        return [];
    }
    const longest = Math.max(...gaps);
    const total = gaps.reduce((sum, one) => sum + one, 0).toFixed(1);
    return [
        {
            kind: "stamps",
            what: `${table.file}: ${gaps.length} gaps, ${total} s without odometry`,
            sure:
                `the longest is ${longest.toFixed(1)} s before line ${intervals.indexOf(longest) + 3}; ` +
                `rows are ${usual.toFixed(3)} s apart`,
            mend: "cut the log there; or let the logger keep every row",
        },
    ];
}

function fileDegrees(table) {
    const values = table.column("bearing_rad");
    if (!areDegrees(values)) {
        return [];
    }
    table.multiply("bearing_rad", Math.PI / 180);
    return [degreesFinding(values, table.file)];
}

/** Whether so many are beyond a full turn that they cannot be single errors. */
function areDegrees(values) {
    return beyondFullTurn(values) > DEGREES_SHARE * values.length;
}

function beyondFullTurn(values) {
    return values.filter((value) => Math.abs(value) > 2 * Math.PI).length;
}

function degreesFinding(values, file) {
    const largest = values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    return {
        kind: "degrees",
        what: `${file}: bearing_rad is in degrees`,
        sure:
            `${beyondFullTurn(values)} of ${values.length} values are beyond 2 pi; ` +
            `the largest is ${largest.toFixed(1)}`,
        mend: `multiply bearing_rad of ${file} by pi/180 = 0.0174533`,
    };
}
