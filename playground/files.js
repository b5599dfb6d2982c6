"use strict";
// Files that were dropped or chosen, as texts by their names.

const LOG_FILES = ["odometry.csv", "sightings.csv", "truth.csv", "beacons.csv", "robot.toml"];
const FILE_BYTES_MAX = 256 << 20;

/** Every file of a drop, those in its folders too, and what to call them together. */
async function droppedFiles(transfer) {
    const files = [...transfer.files];
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.());
    const folder = entries.find((entry) => entry?.isDirectory);
    if (!folder) {
        return { name: "log", files };
    }
    const found = await Promise.all(entries.filter(Boolean).map(filesOfEntry));
    return { name: folder.name, files: found.flat() };
}

async function filesOfEntry(entry) {
    if (entry.isFile) {
        return [await new Promise((resolve, reject) => entry.file(resolve, reject))];
    }
    const reader = entry.createReader();
    const found = [];
    for (
        let some;
        (some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))).length;

    ) {
        found.push(...some.filter((one) => one.isFile)); // of the log's folder itself
    }
    return (await Promise.all(found.map(filesOfEntry))).flat();
}

/** Texts of the files of a log by their names without ".gz". Throws PageError if there is none. */
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
    if (Object.keys(texts).length === 0) {
        const names = files.map((file) => file.name).join(", ") || "nothing";
        throw new PageError(
            `${names}: no file of a log; allowed: ${LOG_FILES.join(", ")}, each perhaps as .gz`,
        );
    }
    return texts;
}

async function textOf(file) {
    if (file.size > FILE_BYTES_MAX) {
        throw new PageError(`${file.name}: it holds more than 256 MB of text; allowed: at most that`);
    }
    try {
        const stream = file.name.endsWith(".gz")
            ? file.stream().pipeThrough(new DecompressionStream("gzip"))
            : file.stream();
        return new TextDecoder("utf-8", { fatal: true }).decode(await new Response(stream).arrayBuffer());
    } catch (error) {
        throw new PageError(
            `${file.name}: cannot be read: ${error.message}; allowed: UTF-8 text, gzipped if named .gz`,
        );
    }
}
