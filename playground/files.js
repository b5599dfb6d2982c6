"use strict";
// Files that were dropped or chosen, as texts by their names.

const LOG_FILES = ["odometry.csv", "sightings.csv", "truth.csv", "beacons.csv", "robot.toml"];
const FILE_BYTES_MAX = 256 << 20;

/** Every file of a drop, those in its folders too, and what to call them together. Throws PageError. */
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

/** The files of a dropped folder itself: by handles, which work without a server, or where there are none. */
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
