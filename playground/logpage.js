"use strict";
// A log on the page, in place of the room.

const PLOT_ROWS_MAX = 4000;

function bindFiles() {
    element("files").addEventListener("change", (event) => {
        loadFiles({ name: "log", files: [...event.target.files] });
        event.target.value = ""; // so that the same may be chosen again
    });
    for (const name of ["dragenter", "dragover"]) {
        window.addEventListener(name, (event) => {
            event.preventDefault();
            document.body.classList.add("dropping");
        });
    }
    window.addEventListener("dragleave", (event) => {
        document.body.classList.toggle("dropping", event.relatedTarget !== null);
    });
    window.addEventListener("drop", (event) => {
        event.preventDefault();
        document.body.classList.remove("dropping");
        loadFiles(droppedFiles(event.dataTransfer));
    });
}

/** Checks a log and runs it. given: its name and files, or their promise. What is none is named, and the
 * page stays as it is. */
async function loadFiles(given) {
    await asNewest(async (isNewest) => {
        const { name, files } = await given;
        const texts = await logTexts(files);
        if (!isNewest()) {
            return;
        }
        say(`${name}: is checked`);
        await breath();
        const checked = await checkLog(name, texts);
        if (isNewest()) {
            await runLog(checked, usualChoices(checked.log));
        }
    });
}

async function runLog(checked, choices) {
    await asNewest(async (isNewest) => {
        say(`${checked.log.name}: runs`);
        const replay = await new Replay(checked.log, { ...choices, recovery: false }).run(isNewest);
        if (!isNewest()) {
            return;
        }
        page.shown = { checked, replay, result: evaluate(replay) };
        page.roomChoices = page.roomChoices || readChoices();
        writeChoices(choices);
        setMode(true);
        say("");
        show();
    });
}

/** Does it in place of what is under way; the action asks after each wait whether it is the newest still.
 * Its PageError becomes the page's message, and the choices are again those of the log that is shown. */
async function asNewest(action) {
    const run = (page.newestRun = {});
    const isNewest = () => page.newestRun === run;
    try {
        await action(isNewest);
    } catch (error) {
        if (!(error instanceof PageError)) {
            throw error;
        }
        if (isNewest()) {
            say(error.message);
            if (page.shown) {
                writeChoices(page.shown.replay.choices);
            }
        }
    } finally {
        if (isNewest()) {
            page.newestRun = null;
        }
    }
}

function writeChoices(choices) {
    WORDS.forEach((id) => (element(id).value = choices[id]));
}

function backToRoom() {
    writeChoices(page.roomChoices);
    page.shown = page.roomChoices = page.newestRun = null;
    say("");
    setMode(false);
    show();
    wake();
}

function setMode(isLog) {
    hide(".room", isLog);
    hide(".log", !isLog);
    element("title").textContent = isLog ? logTitle(page.shown.checked) : "A robot in a room";
    hide(".truePath", isLog && page.shown.checked.log.truth === null);
    hide(".trueBeacons", isLog && page.shown.checked.log.beacons === null);
}

function hide(selector, isHidden) {
    document.querySelectorAll(selector).forEach((one) => (one.hidden = isHidden));
}

/** The verdict first. */
function logTitle({ log, findings }) {
    const count = findings.length;
    return `${log.name}: ${count} finding${count === 1 ? "" : "s"}`;
}

function showLog({ checked, replay, result }) {
    const { poses } = replay;
    const lastTruth = result.truth[result.truth.length - 1];
    const path = thinned(poses);
    const truePath = thinned(result.truth);
    const odometryPath = thinned(deadReckoning(checked.log));
    const trueBeacons = result.trueBeacons.map((one) => ({
        ...one,
        name: identityText(checked.log, one.id),
    }));
    const pose = poses[poses.length - 1];
    new MapView(element("map"), {
        bounds: boundsOfLog(replay, result),
        path,
        truePath,
        odometryPath,
        trueBeacons,
        beacons: result.beacons.map((one) => ({ ...one, name: logName(checked.log, trueBeacons, one) })),
        pose,
        truePose: Number.isFinite(lastTruth.theta) ? lastTruth : null,
    });
    drawPlots(element("plots"), thinned(result.errors));
    showFigures(logFigures(replay, result));
    showFindings(checked);
}

function meanOf(rows, column) {
    const known = rows.map((row) => row[column]).filter(Number.isFinite);
    return known.reduce((sum, value) => sum + value, 0) / known.length;
}

function thinned(rows) {
    const every = Math.ceil(rows.length / PLOT_ROWS_MAX) || 1;
    return rows.filter((_, row) => row % every === 0);
}

/** Of a mapped beacon, unless its true one bears the name already. */
function logName(log, trueBeacons, beacon) {
    if (beacon.label < 0) {
        return `#${beacon.uid}`;
    }
    return trueBeacons.some((one) => one.id === beacon.label) ? "" : identityText(log, beacon.label);
}

/** Of the paths and of what was seen from them. */
function boundsOfLog({ poses }, { truth, trueBeacons, beacons }) {
    const places = [...poses, ...truth, ...trueBeacons];
    const known = boundsOf(places);
    const widest = Math.max(known.right - known.left, known.top - known.bottom);
    const ellipses = [...beacons, gaussianOf(poses[poses.length - 1])];
    return boundsOf([...places, ...ellipses.flatMap((one) => cornersOf(one, widest))]);
}

/** Of an ellipse; none of one so wide that in its picture the path would be a point. */
function cornersOf(gaussian, widest) {
    const { x, y } = gaussian;
    const { major } = ellipse95(gaussian);
    return major < widest
        ? [
              { x: x - major, y: y - major },
              { x: x + major, y: y + major },
          ]
        : [];
}

function boundsOf(places) {
    const bounds = { left: 0, right: 0, bottom: 0, top: 0 };
    for (const { x, y } of places.filter((one) => Number.isFinite(one.x))) {
        bounds.left = Math.min(bounds.left, x);
        bounds.right = Math.max(bounds.right, x);
        bounds.bottom = Math.min(bounds.bottom, y);
        bounds.top = Math.max(bounds.top, y);
    }
    const margin = 0.5 + 0.03 * Math.max(bounds.right - bounds.left, bounds.top - bounds.bottom);
    return {
        left: bounds.left - margin,
        right: bounds.right + margin,
        bottom: bounds.bottom - margin,
        top: bounds.top + margin,
    };
}

function logFigures(replay, result) {
    const last = replay.poses[replay.poses.length - 1];
    const counts = replay.ledger.counts;
    const known = result.errors.map((row) => row[1]).filter(Number.isFinite);
    const refused = Object.entries(replay.refusals)
        .map(([name, count]) => `${count} ${name}`)
        .join(", ");
    const figures = [
        ["time", `${lastOf(result.errors, 0).toFixed(1)} s`],
        [
            "last pose x, y, heading",
            `${last.x.toFixed(2)}, ${last.y.toFixed(2)}\u00a0m, ${last.theta.toFixed(2)}\u00a0rad`,
        ],
        ["beacons in the map (room for 80)", String(result.beacons.filter((one) => one.confirmed).length)],
        [
            "sightings matched, new, not used",
            `${counts.right + counts.wrong}, ${counts.new}, ${counts.rejected}`,
        ],
        ["inputs refused", refused || "none"],
    ];
    if (known.length) {
        const largest = known.reduce((most, one) => Math.max(most, one), 0);
        figures.push([
            "error mean, largest",
            `${centimetres(meanOf(result.errors, 1))}, ${centimetres(largest)}`,
        ]);
    }
    if (result.errors.some((row) => Number.isFinite(row[2]))) {
        figures.push(["mean NEES (3 is right)", meanOf(result.errors, 2).toFixed(1)]);
    }
    if (Number.isFinite(result.mapError)) {
        figures.push(["error of the map (RMSE)", centimetres(result.mapError)]);
    }
    if (known.length && result.isAligned) {
        figures.push(["truth is", "in a frame of its own: aligned"]);
    }
    return figures;
}

function showFindings({ log, findings, untested }) {
    const lines = findings.map(({ kind, what, sure, mend }) =>
        paragraph(`${kind}: ${what}`, `sure: ${sure}`, `mend: ${mend}`),
    );
    lines.push(...log.notes.map((note) => paragraph(`note: ${note}`)));
    lines.push(...untested.map((one) => paragraph("", `not tested: ${one}`)));
    element("findings").replaceChildren(
        ...(findings.length ? [] : [paragraph("nothing was found")]),
        ...lines,
    );
}

function paragraph(text, ...quietLines) {
    const made = document.createElement("p");
    made.textContent = text;
    for (const line of quietLines) {
        const small = document.createElement("small");
        small.textContent = line;
        made.append(small);
    }
    return made;
}
