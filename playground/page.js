"use strict";
// What the user does, and what the page shows.

const KEYS = {
    ArrowUp: [1, 0],
    KeyW: [1, 0],
    ArrowDown: [-1, 0],
    KeyS: [-1, 0],
    ArrowLeft: [0, 1],
    KeyA: [0, 1],
    ArrowRight: [0, -1],
    KeyD: [0, -1],
};
const STEPS_A_PICTURE = 60; // a slow machine drives slower than asked, and stays usable
const TAP_MS = 400;
const FIRST_STEPS = 25; // so that there is a map at once
const NUMBERS = ["wheelNoise", "toldNoise", "beacons", "seed", "fieldOfView"];
const WORDS = ["filter", "association", "observation"];

const element = (id) => document.getElementById(id);
const page = {
    drive: null,
    shown: null, // a log in place of the room
    roomChoices: null, // to go back to
    newestRun: null, // of a log, while it is under way
    isPlaying: true,
    held: new Set(),
    isAwake: false, // steps are taken as time goes by
    lastMs: 0,
    owedSteps: 0,
};

function readChoices() {
    const numbers = NUMBERS.map((id) => [id, Number(element(id).value)]);
    return Object.fromEntries([...WORDS.map((id) => [id, element(id).value]), ...numbers]);
}

function say(text) {
    element("message").textContent = text;
    element("message").hidden = text === "";
}

function restart() {
    const bad = NUMBERS.map(element).find((field) => !field.checkValidity());
    if (bad) {
        say(`${bad.id} ${quoted(bad.value)} is not allowed; allowed: an integer from ${bad.min} to ${bad.max}`);
        return;
    }
    page.drive = new Drive(readChoices());
    page.owedSteps = 0;
    for (let step = 0; step < FIRST_STEPS; step++) {
        page.drive.step(null);
    }
    if (!page.newestRun) {
        say(""); // but what a log is about to do stays
    }
    show();
}

/** What the keys and pads say; null: the robot drives itself. */
function command() {
    if (element("self").checked) {
        return null;
    }
    const wanted = { forward: 0, turn: 0 };
    for (const [forward, turn] of [...page.held].map((key) => KEYS[key])) {
        wanted.forward += forward;
        wanted.turn += turn;
    }
    return { forward: limited(wanted.forward), turn: limited(wanted.turn) };
}

/** Goes on with the drive, unless it goes already or stands still. */
function wake() {
    if (!page.isAwake) {
        page.isAwake = true;
        page.lastMs = performance.now();
        requestAnimationFrame(tick);
    }
}

function tick(nowMs) {
    page.isAwake = page.isPlaying && !page.shown;
    if (!page.isAwake) {
        return;
    }
    const elapsedMs = Math.min(Math.max(nowMs - page.lastMs, 0), 100);
    page.lastMs = nowMs;
    page.owedSteps += (1e3 * elapsedMs * Number(element("speed").value)) / STEP_US;
    const steps = Math.min(Math.floor(page.owedSteps), STEPS_A_PICTURE);
    page.owedSteps = steps === STEPS_A_PICTURE ? 0 : page.owedSteps - steps;
    if (steps > 0) {
        takeSteps(steps);
    }
    requestAnimationFrame(tick);
}

function takeSteps(count) {
    for (let step = 0; step < count; step++) {
        page.drive.step(command());
    }
    show();
}

// ---- showing ----------------------------------------------------------------------------------------------

function show() {
    if (page.shown) {
        showLog(page.shown);
    } else {
        showDrive(page.drive);
    }
}

function showDrive(drive) {
    new MapView(element("map"), {
        bounds: ROOM,
        walls: ROOM,
        truePath: drive.truePath.points,
        odometryPath: drive.odometryPath.points,
        path: drive.path.points,
        trueBeacons: drive.world.beacons.map((beacon) => ({ ...beacon, name: String(beacon.id) })),
        beacons: drive.beacons.map((beacon) => ({ ...beacon, name: nameOf(beacon) })),
        sightings: drive.sightings,
        pose: drive.pose,
        truePose: drive.world.pose,
    });
    drawPlots(element("plots"), drive.errors.slice(-KEPT_ROWS));
    showFigures(driveFigures(drive));
    element("wheelNoiseText").textContent = `${drive.choices.wheelNoise.toFixed(2)} m/s`;
    element("beaconsText").textContent = String(drive.choices.beacons);
}

/** A beacon that was told has its true beacon's number there already. */
function nameOf(beacon) {
    return beacon.label >= 0 ? "" : `#${beacon.uid}`;
}

function driveFigures(drive) {
    const { right, wrong, new: started, rejected } = drive.ledger.counts;
    const health = drive.estimator.health();
    return [
        ["time", `${(1e-6 * drive.world.timeUs).toFixed(1)} s`],
        ["robot is", drive.world.isSlipping ? `${health.state}, wheel slips` : health.state],
        ["error now, mean", `${centimetres(lastOf(drive.errors, 1))}, ${centimetres(drive.meanError.value)}`],
        ["mean NEES (3 is right)", drive.meanNees.value.toFixed(1)],
        ["beacons in the map, in the room", `${health.beacons}, ${drive.world.beacons.length}`],
        ["matches right, wrong", `${right}, ${wrong}`],
        ["sightings new, not used", `${started}, ${rejected}`],
        ["fingerprint", drive.estimator.fingerprint()],
    ];
}

function showFigures(rows) {
    const table = element("figures");
    table.replaceChildren(
        ...rows.map(([name, value]) => {
            const row = document.createElement("tr");
            const head = document.createElement("th");
            head.scope = "row";
            head.textContent = name;
            const cell = document.createElement("td");
            cell.textContent = value;
            row.append(head, cell);
            return row;
        }),
    );
}

function lastOf(rows, column) {
    return rows.length ? rows[rows.length - 1][column] : NaN;
}

function centimetres(metres) {
    return `${(100 * metres).toFixed(1)} cm`;
}

// ---- doing ------------------------------------------------------------------------------------------------

function setPlaying(isPlaying) {
    page.isPlaying = isPlaying;
    element("pause").textContent = isPlaying ? "Pause" : "Go on";
    wake();
}

function hold(key) {
    element("self").checked = false;
    page.held.add(key);
}

/** A pad that was pressed with a key of the keyboard. */
function tap(key) {
    hold(key);
    setTimeout(() => page.held.delete(key), TAP_MS);
}

function isTyping(target) {
    return target instanceof HTMLElement && target.matches("input:not([type=checkbox]), select");
}

function onKeyDown(event) {
    if (page.shown || event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) {
        return;
    }
    if (event.code in KEYS) {
        hold(event.code);
        event.preventDefault();
    } else if (event.code === "Space" && !event.target.matches?.("button, input")) {
        setPlaying(!page.isPlaying);
        event.preventDefault();
    }
}

function bindPads() {
    for (const pad of document.querySelectorAll("#pads button")) {
        const key = pad.dataset.key;
        pad.addEventListener("pointerdown", () => hold(key));
        pad.addEventListener("contextmenu", (event) => event.preventDefault());
        pad.addEventListener("click", (event) => event.detail || tap(key));
        for (const end of ["pointerup", "pointerleave", "pointercancel"]) {
            pad.addEventListener(end, () => page.held.delete(key));
        }
    }
}

function bind() {
    window.addEventListener("keydown", onKeyDown);
    window.addEventListener("keyup", (event) => page.held.delete(event.code));
    window.addEventListener("blur", () => page.held.clear());
    window.addEventListener("resize", show);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
    bindPads();
    for (const id of ["pads", "run"]) {
        // A click takes no focus, or the space bar would press that button again in place of a pause.
        element(id).addEventListener("mousedown", (event) => event.preventDefault());
    }
    element("pause").addEventListener("click", () => setPlaying(!page.isPlaying));
    element("step").addEventListener("click", () => {
        setPlaying(false);
        takeSteps(1);
    });
    element("restart").addEventListener("click", restart);
    element("room").addEventListener("click", backToRoom);
    element("slip").addEventListener("click", () => page.drive.world.slip());
    element("kidnap").addEventListener("click", () => page.drive.kidnap());
    for (const id of [...NUMBERS, ...WORDS]) {
        element(id).addEventListener("input", onChoice);
    }
}

function onChoice() {
    if (page.shown) {
        runLog(page.shown.checked, readChoices());
    } else {
        restart();
    }
}

function begin() {
    bind();
    bindFiles();
    restart();
    wake();
}

try {
    begin();
} catch (error) {
    say(`This browser cannot run the estimator (WebAssembly): ${error.message}`);
    throw error;
}
