"use strict";
// A log tested before it is believed, in the words of host_sim/bslam/logcheck. What takes the fit of the
// whole drive (scales, noise, mount, identities) is left to `bslam check`.

const SLIPS_MAX = 3;
const NAMELESS_SHARE = 0.05;
const OUTSIDE_SHARE = 0.2;
const DELAY_S = 0.08;
const DELAY_ROWS = 2;
const LEAD_S = 0.3; // of commands before the motion
const BLIND = "all else: it takes a robot that moves and beacons with identities, seen again within a second";
const HANGING = "all else: it takes sightings that change";
const STRAIGHT = "signs and scale of the turn: it hardly turns while beacons are seen";
const HELD_BACK = "all else: mend this first, then check again";
const LEFT_TO_HOST = "scales, mount, noise, view, identities: `bslam check` tests them";

/** texts: contents by file name. The log as it is, and what is wrong with it: of the drive, what is so with
 * the files put right. Throws PageError, with what is wrong with the files, for what the host refuses. */
async function checkLog(name, texts) {
    const mended = { ...texts };
    const inFiles = checkFiles(mended);
    try {
        const log = readLog(name, texts);
        const { findings, untested } = await checkDrive(inFiles.length ? readLog(name, mended) : log);
        return { log, findings: [...inFiles, ...findings], untested };
    } catch (error) {
        const found = inFiles.map(({ what, mend }) => `; check finds: ${what}; mend: ${mend}`);
        throw error instanceof PageError ? new PageError(error.message + found.join("")) : error;
    }
}

async function checkDrive(log) {
    const findings = [...missingIdentities(log), ...outsideOdometry(log)];
    const sums = summedUp(log);
    if (sums.length) {
        return { findings: [...findings, ...sums], untested: [HELD_BACK] };
    }
    let { drive, flow, factors } = inSi(log, NO_FACTORS, findings);
    if (!flow) {
        return { findings, untested: [BLIND] };
    }
    const unknown = unknownUnit(log, flow);
    if (unknown.length) {
        return { findings: [...findings, ...unknown], untested: [HELD_BACK] };
    }
    const still = hangingDetector(drive);
    if (still.length) {
        return { findings: [...findings, ...still], untested: [HANGING] };
    }
    const untested = Math.abs(flow.turn) > 2 * flow.turnError ? [LEFT_TO_HOST] : [STRAIGHT, LEFT_TO_HOST];
    const signed = signsOf(flow);
    factors = together(factors, signed);
    const fitted = drive.hasRanges ? await fittedReferences(log, factors) : [];
    findings.push(...signFindings(log, signed, flow, fitted));
    drive = new CheckedDrive(log, factors);
    findings.push(...delayFinding(drive, bestFlow(drive) || flow));
    return { findings, untested };
}

/** The drive after all slips of units are put right, its flow, and the factors that do it. */
function inSi(log, factors, findings) {
    let drive = new CheckedDrive(log, factors);
    let flow = drive.isUsable ? bestFlow(drive) : null;
    for (let slips = 0; flow && slips < SLIPS_MAX; slips++) {
        const slip = unitSlip(log, drive, flow);
        if (!slip) {
            break;
        }
        factors = together(factors, slip.factors);
        findings.push(slip.finding);
        drive = new CheckedDrive(log, factors);
        flow = bestFlow(drive);
    }
    return { drive, flow, factors };
}

/** Sightings that do not say whose they are. */
function missingIdentities(log) {
    const ids = log.sightings.id.filter((_, row) => log.sightings.mappable[row]);
    const nameless = ids.filter((id) => id < 0).length;
    if (nameless <= NAMELESS_SHARE * ids.length) {
        return [];
    }
    return [
        {
            kind: "identities",
            what: `${nameless} of ${ids.length} sightings have no identity`,
            sure: "beacon_id is empty",
            mend: "--association mahalanobis, or svm where there are signatures",
        },
    ];
}

/** Sightings of which odometry knows nothing. */
function outsideOdometry(log) {
    const [seen, known, step] = [log.sightings.timeUs, log.odometry.timeUs, log.robot.step_us];
    const [first, last] = [known[0], known[known.length - 1]];
    const out = seen.filter((time) => time < first - step || time > last + step).length;
    if (out <= OUTSIDE_SHARE * seen.length) {
        return [];
    }
    return [
        {
            kind: "stamps",
            what: `${out} of ${seen.length} sightings are before or after odometry`,
            sure: `they run from ${seen[0]} to ${seen.at(-1)} us, odometry from ${first} to ${last}`,
            mend: "let one clock stamp both, or shift time_us",
        },
    ];
}

/** Sightings that stay the same, of a robot that moves. */
function hangingDetector(drive) {
    const different = new Set(drive.ids.map((id, row) => `${id},${drive.bearing[row]},${drive.range[row]}`));
    if (different.size !== new Set(drive.ids).size) {
        return [];
    }
    return [
        {
            kind: "sightings",
            what: "sightings do not change while odometry moves",
            sure: "each is equal to the first of its beacon",
            mend: "a detector that hangs: let it look anew for each frame",
        },
    ];
}

/** Sightings that come late, or early, beyond what is told; by what odometry leaves unexplained of them. */
function delayFinding(drive, flow) {
    const delayS = refinedDelay(flow) - drive.delayS;
    const isUntoldLead = drive.isCommanded && drive.delayS === 0;
    const limitS = isUntoldLead ? LEAD_S : Math.max(DELAY_S, DELAY_ROWS * drive.rowS);
    if (flow.delayS === drive.delayS || Math.abs(delayS) <= limitS) {
        return [];
    }
    const told = drive.delayS ? `, besides the ${(1e3 * drive.delayS).toFixed(0)} ms that are told` : "";
    const late = delayS > 0 ? "late" : "early";
    const wholeUs = Math.round(1e6 * (delayS + drive.delayS));
    const shift = `add ${Math.round(-1e6 * delayS)} to time_us of sightings.csv`;
    return [
        {
            kind: "delay",
            what: `sightings come ${(1e3 * Math.abs(delayS)).toFixed(0)} ms ${late} against odometry${told}`,
            sure:
                "by how bearings and ranges follow odometry, to some 20 ms; " +
                `odometry's rows are ${(1e3 * drive.rowS).toFixed(0)} ms apart`,
            mend: wholeUs >= 0 ? `--set sighting_delay_us=${wholeUs}` : shift,
        },
    ];
}

/** Between the delays that were tried: the lowest point of a parabola through the best and its neighbours. */
function refinedDelay({ spreads, delayS }) {
    const place = DELAYS_S.indexOf(delayS);
    if (place < 1 || place > DELAYS_S.length - 2) {
        return delayS;
    }
    const [before, at, after] = spreads.slice(place - 1, place + 2);
    const bend = before - 2 * at + after;
    return bend > 0 ? delayS + (0.5 * (DELAYS_S[1] - DELAYS_S[0]) * (before - after)) / bend : delayS;
}
