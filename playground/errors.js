"use strict";
// Messages, and the numbers and names in them.

/** What the page says instead of doing what was asked: what, where, what is allowed. */
class PageError extends Error {}

const NEAR_RATIO = 0.6; // of Python's difflib, whose measure this is: Ratcliff and Obershelp's

/** What to append to a message about `word`: the nearest allowed name; "" where none is near. */
function didYouMean(word, allowed) {
    const plain = (name) => name.toLowerCase().replaceAll("-", "_");
    let [nearest, best] = ["", NEAR_RATIO];
    for (const name of allowed) {
        const ratio = (2 * commonLetters(plain(name), plain(word))) / (name.length + word.length);
        [nearest, best] =
            ratio > best || (ratio === best && name > nearest) ? [name, ratio] : [nearest, best];
    }
    return nearest && `; did you mean ${quoted(nearest)}?`;
}

/** Letters in the longest common part of two texts, and in those before and behind it. */
function commonLetters(a, b) {
    let [size, atA, atB] = [0, 0, 0];
    for (let i = 0; i < a.length; i++) {
        for (let j = 0; j < b.length; j++) {
            let length = 0;
            while (i + length < a.length && a[i + length] === b[j + length]) {
                length++;
            }
            [size, atA, atB] = length > size ? [length, i, j] : [size, atA, atB];
        }
    }
    if (size === 0) {
        return 0;
    }
    const before = commonLetters(a.slice(0, atA), b.slice(0, atB));
    return size + before + commonLetters(a.slice(atA + size), b.slice(atB + size));
}

/** A text in quotes, as Python prints it. */
function quoted(given) {
    const text = given.replaceAll("\\", "\\\\").replaceAll("\t", "\\t");
    return text.includes("'") && !text.includes('"') ? `"${text}"` : `'${text.replaceAll("'", "\\'")}'`;
}

/** A value of a file, as Python prints it: a number, a text in quotes, a table of these. */
function shown(value) {
    if (typeof value === "object") {
        const pairs = Object.entries(value).map(([key, one]) => `${quoted(key)}: ${shown(one)}`);
        return `{${pairs.join(", ")}}`;
    }
    return typeof value === "string" ? quoted(value) : String(value);
}

/** A number as C's %g has it. */
function general(value, digits = 6) {
    const [mantissa, exponent] = value
        .toExponential(digits - 1)
        .split("e")
        .map(Number);
    if (exponent < -4 || exponent >= digits) {
        const sign = exponent < 0 ? "-" : "+";
        return `${mantissa}e${sign}${String(Math.abs(exponent)).padStart(2, "0")}`;
    }
    return String(Number(value.toPrecision(digits)));
}
