"use strict";
// Strict reading of csv files, in the words of host_sim/bslam/parsing/csvtable.py.

const HEAD_ROWS = 10; // so many at the start may have stamps that the clock has not come to

const NUMBER_TEXT = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

/** NaN for what is no finite number. */
function numberOf(text) {
    return NUMBER_TEXT.test(text) ? Number(text) : NaN;
}

function linesOf(text) {
    const lines = text.split(/\r\n|\n|\r/);
    return lines[lines.length - 1] === "" ? lines.slice(0, -1) : lines;
}

/** The fields of a line; one in double quotes may hold commas. */
function fieldsOf(line) {
    if (!line.includes('"')) {
        return line.split(",");
    }
    const fields = [...`,${line}`.matchAll(/,(?:"((?:[^"]|"")*)"?)?([^,]*)/g)];
    return fields.map(([, within = "", behind]) => within.replaceAll('""', '"') + behind);
}

/** The columns of a file: texts and values by name, and of each row its line. */
class Table {
    constructor(file, texts, values, lines) {
        Object.assign(this, { file, texts, values, lines });
    }

    get rows() {
        return this.lines.length;
    }

    has(name) {
        return name in this.values;
    }

    /** Without the rows that are not kept. */
    only(kept) {
        const cut = (columns) =>
            Object.fromEntries(
                Object.entries(columns).map(([name, column]) => [name, column.filter((_, row) => kept[row])]),
            );
        return new Table(
            this.file,
            cut(this.texts),
            cut(this.values),
            this.lines.filter((_, row) => kept[row]),
        );
    }

    require(column, isGood, allowed) {
        const row = this.lines.findIndex((_, index) => !isGood(index));
        if (row >= 0) {
            throw fieldError(this.file, this.lines[row], column, this.texts[column][row], allowed);
        }
    }

    requireRows(allowed) {
        if (this.rows === 0) {
            throw new PageError(`${this.file}: no rows below the header; ${allowed}`);
        }
    }

    requireOrder(isStrict) {
        const times = this.values.time_us;
        const rises = (row) =>
            isStrict ? times[row] > (times[row - 1] ?? -1) : times[row] >= (times[row - 1] ?? -1);
        this.require("time_us", rises, `a value ${isStrict ? "above" : "not below"} that of the row before`);
    }

    /** Without rows that say once more, in every column, what one above says. */
    unrepeated(notes) {
        const names = Object.keys(this.values);
        const columns = names.map((name) =>
            this.values[name].every(isNaN) ? this.texts[name] : this.values[name],
        );
        const known = new Set();
        const kept = this.lines.map((_, row) => {
            const key = columns.map((column) => column[row]).join("\n");
            return !known.has(key) && known.add(key) !== null;
        });
        const count = kept.filter((one) => !one).length;
        if (count > 0) {
            const first = this.lines[kept.indexOf(false)];
            notes.push(`${this.file}: left out ${rowsText(count)} equal to one above, first line ${first}`);
        }
        return count > 0 ? this.only(kept) : this;
    }

    /** Without a short head of rows that are all later than what follows. */
    begun(notes) {
        const first = beganAt(this.values.time_us);
        if (first === 0) {
            return this;
        }
        const where = `line ${this.lines[first]}, time_us ${this.texts.time_us[first]}`;
        notes.push(`${this.file}: left out ${rowsText(first)} at the start: time runs back to ${where}`);
        return this.only(this.lines.map((_, row) => row >= first));
    }
}

function rowsText(count) {
    return `${count} row${count > 1 ? "s" : ""}`;
}

function beganAt(times) {
    let first = 0;
    for (let row = 1; row <= HEAD_ROWS && row < times.length; row++) {
        first = times[row] < times[row - 1] ? row : first;
    }
    return first > 0 && times.slice(0, first).every((time) => time >= times[first]) ? first : 0;
}

/** layouts: sets of columns, one of which must be there. rules: of each column, `allowed` and `holds`. */
function readTable(file, text, layouts, optional, rules) {
    const lines = linesOf(text);
    const names = lines.length ? fieldsOf(lines[0]).map((name) => name.trim()) : [];
    matchLayout(file, names, layouts, optional, rules);
    const rows = lines.slice(1).map((line, index) => rowOf(file, line, index + 2, names.length));
    const texts = Object.fromEntries(names.map((name, place) => [name, rows.map((row) => row[place])]));
    const values = Object.fromEntries(
        names.map((name) => [name, parsed(file, name, rules[name], texts[name])]),
    );
    return new Table(
        file,
        texts,
        values,
        rows.map((_, row) => row + 2),
    );
}

function rowOf(file, line, number, width) {
    const fields = fieldsOf(line);
    if (fields.length !== width) {
        throw new PageError(
            `${file}, line ${number}: ${quoted(line)} has ${fields.length} fields; allowed: ${width}`,
        );
    }
    return fields.map((field) => field.trim());
}

function matchLayout(file, names, layouts, optional, rules) {
    const required = names
        .filter((name) => !optional.includes(name))
        .sort()
        .join();
    const isUnique = new Set(names).size === names.length;
    if (isUnique && layouts.some((layout) => [...layout].sort().join() === required)) {
        return;
    }
    const wanted = layouts.map((layout) => layout.join()).join(" or ");
    const extra = optional.length ? ` (and perhaps ${optional.join()})` : "";
    if (!names.some(Boolean)) {
        const where = names.length ? `${file}, line 1` : file;
        throw new PageError(`${where}: is empty; allowed: columns ${wanted}${extra}`);
    }
    const missing = layouts[0].filter((name) => rules[name].why && !names.includes(name));
    const why = missing.map((name) => `; ${rules[name].why}`).join("");
    const known = [...new Set([...layouts.flat(), ...optional])];
    const said = `columns ${quoted(names.join())} are not allowed`;
    const which = offender(names, known);
    throw new PageError(`${file}, line 1: ${said}; allowed: ${wanted}${extra}${why}${which}`);
}

/** Which of the names is wrong, as far as one alone is, and how to mend it. */
function offender(names, known) {
    const separator = names.length === 1 && [...";\t |"].find((one) => names[0].includes(one));
    if (separator) {
        return `; commas separate columns, not ${quoted(separator)}, and 0.5 is written with a point`;
    }
    if (names.includes("")) {
        return `; column ${names.indexOf("") + 1} has no name: of pandas? to_csv(..., index=False)`;
    }
    const unknown = names.filter((name) => !known.includes(name));
    if (unknown.length) {
        const free = known.filter((name) => !names.includes(name));
        return `; not one of them: ${unknown.map(quoted).join(", ")}${didYouMean(unknown[0], free)}`;
    }
    const twice = names.find((name, place) => names.indexOf(name) !== place);
    return twice ? `; ${quoted(twice)} is there twice` : "";
}

function parsed(file, name, rule, texts) {
    if (rule.isWord) {
        return texts.map(() => NaN);
    }
    return texts.map((text, row) => {
        const value = numberOf(text);
        if (text === "" && rule.mayBeEmpty) {
            return NaN;
        }
        if (Number.isNaN(value) || !rule.holds(value)) {
            const why = rule.why && text === "" ? `; ${rule.why}` : "";
            throw fieldError(file, row + 2, name, text, rule.allowed + why);
        }
        return value;
    });
}

function fieldError(file, line, name, text, allowed) {
    return new PageError(
        `${file}, line ${line}, column ${name}: ${quoted(text)} is not allowed; allowed: ${allowed}`,
    );
}
