"use strict";
// The C estimator, compiled to WebAssembly. An instance of the module is a robot: memory of its own.

const PRESETS = ["real-wheels", "paper", "commanded", "camera", "bearing-only"];
const FILTERS = ["standard", "invariant", "smoother"];
const ASSOCIATIONS = ["known", "nearest", "mahalanobis", "svm", "joint", "position"];
const SOURCES = { wheels: 0, ticks: 1, velocity: 2 };
const OUTCOMES = ["rejected", "matched", "new", "deferred"];
const REASONS = [
    "none",
    "class",
    "no identity",
    "duplicate",
    "ambiguous",
    "appearance",
    "gate",
    "map full",
    "singular",
    "frozen",
    "lost",
    "tentative",
];
const RECOVERY_STATES = ["following", "doubting", "lost"];
const NUMBERS_MAX = 16; // of playground.c
const CLASS_NOT_MAPPABLE = 255;

function decodeBase64(text) {
    return Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
}

const coreModule = new WebAssembly.Module(decodeBase64(document.getElementById("wasm").textContent));

/** One robot. A call that C refuses answers null or false, `status` then says why. */
class Estimator {
    constructor() {
        this.core = new WebAssembly.Instance(coreModule).exports;
        this.names = this.readNames();
        this.ids = new Map(this.names.map((name, id) => [name, id]));
        this.status = "";
        this.inputs = null; // an array here is given every input, for who wants to run it again
    }

    readNames() {
        const names = [];
        for (let at; (at = this.core.page_setting_name(names.length)); ) {
            names.push(this.text(at));
        }
        return names;
    }

    text(at) {
        const bytes = new Uint8Array(this.core.memory.buffer, at);
        return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
    }

    numbers(count) {
        const at = this.core.page_numbers();
        return [...new Float64Array(this.core.memory.buffer, at, NUMBERS_MAX).subarray(0, count)];
    }

    took(status) {
        this.status = status === 0 ? "" : this.text(this.core.page_status_name(status));
        return status === 0;
    }

    /** Every setting by name, as presets one on top of the other have it; they choose by these two. */
    presetSettings(presets, association, filter) {
        for (const preset of ["real-wheels", ...presets]) {
            this.core.page_preset(PRESETS.indexOf(preset));
            this.core.page_set(this.ids.get("association"), ASSOCIATIONS.indexOf(association));
            this.core.page_set(this.ids.get("filter"), FILTERS.indexOf(filter));
        }
        return Object.fromEntries(this.names.map((name, id) => [name, this.core.page_get(id)]));
    }

    /** A robot at the origin of an empty map. Throws PageError for a setting that is out of range. */
    begin(settings) {
        this.core.page_preset(0);
        for (const [name, value] of Object.entries(settings)) {
            this.set(name, value);
        }
        if (!this.took(this.core.page_begin())) {
            const name = this.names[this.core.page_bad_setting()];
            throw new PageError(`setting ${name} = ${settings[name]} contradicts another setting`);
        }
    }

    set(name, value) {
        const id = this.ids.get(name);
        if (id === undefined) {
            throw new Error(`no setting ${name}`);
        }
        this.core.page_setting_limits(id);
        const [low, high, isWhole] = this.numbers(3);
        if (!(value >= low && value <= high) || (isWhole && !Number.isInteger(value))) {
            const kind = isWhole ? "a whole number" : "a number";
            throw new PageError(`setting ${name} = ${value}: allowed is ${kind} from ${low} to ${high}`);
        }
        this.core.page_set(id, value);
    }

    /** One reading; gyroRadps NaN: none. */
    odometry(kind, timeUs, a, b, gyroRadps = NaN, gyroSdRadps = 0) {
        this.inputs?.push(["odometry", kind, timeUs, a, b, gyroRadps, gyroSdRadps]);
        return this.took(this.core.page_odometry(SOURCES[kind], timeUs, a, b, gyroRadps, gyroSdRadps));
    }

    resumeOdometry(positionSdM, headingSdRad) {
        this.inputs?.push(["resume", positionSdM, headingSdRad]);
        return this.took(this.core.page_resume_odometry(positionSdM, headingSdRad));
    }

    /** One image, what became of each sighting; null: refused. A rangeM of NaN: bearing-only. */
    frame(timeUs, sightings) {
        this.inputs?.push(["frame", timeUs, sightings]);
        for (const one of sightings) {
            const beaconClass = one.mappable === false ? CLASS_NOT_MAPPABLE : one.beaconClass || 0;
            const status = this.core.page_sighting(
                one.bearingRad,
                one.rangeM,
                one.label,
                beaconClass,
                one.bearingSdRad || 0,
                one.rangeSdM || 0,
                one.rangeScaleSd || 0,
                one.score || 0,
            );
            if (!this.took(status)) {
                this.core.page_frame(-1); // forgets what was given of it
                return null;
            }
        }
        const isTaken = this.took(this.core.page_frame(timeUs));
        return isTaken ? sightings.map((_, index) => this.account(index)) : null;
    }

    account(index) {
        this.core.page_account(index);
        const [outcome, reason, uid, ratio, weight] = this.numbers(5);
        return { result: OUTCOMES[outcome], reason: REASONS[reason], uid, ratio, weight };
    }

    /** x, y, theta in m and rad; lower: xx, yx, yy, tx, ty, tt of their covariance. */
    pose() {
        this.core.page_pose();
        const [x, y, theta, ...lower] = this.numbers(9);
        return { x, y, theta, lower };
    }

    poseAt(timeUs) {
        if (!this.took(this.core.page_pose_at(timeUs))) {
            return null;
        }
        const [x, y, theta] = this.numbers(3);
        return { x, y, theta };
    }

    health() {
        this.core.page_health();
        const [state, beacons, hypotheses] = this.numbers(3);
        return { state: RECOVERY_STATES[state], beacons, hypotheses };
    }

    /** The map, tentative beacons included. */
    beacons() {
        return Array.from({ length: this.health().beacons }, (_, index) => this.beacon(index));
    }

    beacon(index) {
        this.took(this.core.page_beacon(index));
        const [uid, label, kind, confirmed, sightings, x, y, xx, xy, yy] = this.numbers(10);
        return { uid, label, kind, confirmed: confirmed === 1, sightings, x, y, xx, xy, yy };
    }

    /** Hash of the whole state, 16 hexadecimal digits: the same inputs give the same one on every machine. */
    fingerprint() {
        return BigInt.asUintN(64, this.core.page_fingerprint(0n)).toString(16).padStart(16, "0");
    }
}
