"use strict";
// Files that were dropped or chosen, as texts by their names.

const NEEDED_FILES = ["odometry.csv", "sightings.csv", "robot.toml"];
const LOG_FILES = [...NEEDED_FILES, "truth.csv", "beacons.csv"];
const ROBOT_EXAMPLE = "docs/LOG-FORMAT.md, 'Your own robot's log', has one to copy";
const TEXT_MB_MAX = 256;

/** The files of a drop, or those of its first folder, and what to call them together. Throws PageError. */
async function droppedFiles(transfer) {
    const files = [...transfer.files];
    // Asked for at once: after the first wait the browser has forgotten what was dropped.
    const handles = [...transfer.items].map((item) => item.getAsFileSystemHandle?.());
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.());
    const folder = entries.find((entry) => entry?.isDirectory);
    if (!folder) {
        return { name: "log", files };
    }
    try {
        return {
            name: folder.name,
            files: await filesIn(folder, (await Promise.all(handles)).filter(Boolean)),
        };
    } catch (error) {
        const said = `${folder.name}: this browser does not read a folder here (${error.message})`;
        throw new PageError(`${said}; allowed: its files, all together`);
    }
}

/** The files of a dropped folder, not of folders in it: by handles, if there are: they need no server. */
async function filesIn(folder, handles) {
    const handle = handles.find((one) => one.kind === "directory");
    const found = [];
    if (handle) {
        for await (const one of handle.values()) {
            found.push(...(one.kind === "file" ? [await one.getFile()] : []));
        }
        return found;
    }
    const reader = folder.createReader();
    const some = () => new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    for (let read = await some(); read.length; read = await some()) {
        found.push(...read.filter((one) => one.isFile));
    }
    const fileOf = (entry) => new Promise((resolve, reject) => entry.file(resolve, reject));
    return Promise.all(found.map(fileOf));
}

/** Texts of the files of a log by their names without ".gz". Throws PageError if one that it needs is not
 * there. */
async function logTexts(files) {
    const texts = {};
    for (const file of files) {
        const name = file.name.replace(/\.gz$/, "");
        if (!LOG_FILES.includes(name)) {
            continue; // pictures, signatures, notes
        }
        if (name in texts) {
            throw new PageError(`${name}: it is there twice; allowed: one log, each file once`);
        }
        texts[name] = await textOf(file);
    }
    requireFiles(
        Object.keys(texts),
        files.map((file) => file.name),
    );
    return texts;
}

/** there: files of the log; given: names of all files. */
function requireFiles(there, given) {
    const absent = LOG_FILES.filter((name) => !there.includes(name));
    const capital = given.find((name) => absent.includes(name.toLowerCase().replace(/\.gz$/, "")));
    if (capital) {
        throw new PageError(`${capital}: is no name of a log's file; allowed: ${capital.toLowerCase()}`);
    }
    if (there.length === 0) {
        const names = given.join(", ") || "nothing";
        throw new PageError(
            `${names}: no file of a log; allowed: ${LOG_FILES.join(", ")}, each perhaps as .gz`,
        );
    }
    const missing = NEEDED_FILES.find((name) => absent.includes(name));
    if (missing) {
        const needs = `a log needs ${NEEDED_FILES.join(", ")}, all at once`;
        const example = missing === "robot.toml" ? `; ${ROBOT_EXAMPLE}` : "";
        throw new PageError(`${there.join(", ")}: ${missing} is missing; ${needs}${example}`);
    }
}

async function textOf(file, megabytesMax = TEXT_MB_MAX) {
    try {
        const stream = file.name.endsWith(".gz")
            ? file.stream().pipeThrough(new DecompressionStream("gzip"))
            : file.stream();
        return await decoded(stream.getReader(), megabytesMax);
    } catch (error) {
        const allowed = `at most ${megabytesMax} MB of UTF-8 text, gzipped if named .gz`;
        throw new PageError(`${file.name}: cannot be read: ${error.message}; allowed: ${allowed}`);
    }
}

/** The text that comes, counted while it does: a small packed file may hold any amount. */
async function decoded(reader, megabytesMax) {
    const decoder = new TextDecoder("utf-8", { fatal: true });
    let text = "";
    let bytes = 0;
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
        bytes += part.value.byteLength;
        if (bytes > megabytesMax * 2 ** 20) {
            await reader.cancel();
            throw new Error("it holds too much text");
        }
        text += decoder.decode(part.value, { stream: true });
    }
    return text + decoder.decode();
}
