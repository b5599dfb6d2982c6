"use strict";
// A log through the estimator, in the order of `bslam replay csv`: host_sim/bslam/runs/runner.py.

const INTERRUPTION_US = 4000000;
const UNSEEN_SPEED_MPS = 0.5;
const UNSEEN_POSITION_SD_MAX_M = 30;
const UNSEEN_HEADING_SD_RAD = 3;
const ROWS_AT_ONCE = 1000; // then the page may breathe

/** What a run takes of the log unless asked otherwise. */
function usualChoices(log) {
    const seen = log.sightings;
    const hasRanges = seen.range.some(Number.isFinite) || seen.range.length === 0;
    const hasIdentities = seen.id.some((id) => id >= 0) || seen.id.length === 0;
    return {
        observation: hasRanges ? "distance" : "direction",
        association: hasIdentities ? "known" : "mahalanobis",
        filter: hasRanges ? "invariant" : "smoother",
    };
}

/** Sightings in frames of equal time, as the estimator is to see them. */
function framesOf(log, choices) {
    const s = log.sightings;
    const frames = [];
    s.timeUs.forEach((timeUs, row) => {
        if (frames.length === 0 || frames[frames.length - 1].timeUs !== timeUs) {
            frames.push({ timeUs, sightings: [] });
        }
        frames[frames.length - 1].sightings.push({
            id: s.mappable[row] ? s.id[row] : -1,
            bearingRad: s.bearing[row],
            rangeM: choices.observation === "distance" ? s.range[row] : NaN,
            label: choices.association === "known" && s.mappable[row] ? s.id[row] : -1,
            mappable: s.mappable[row],
            bearingSdRad: s.bearingSd?.[row],
            rangeSdM: s.rangeSd?.[row],
            rangeScaleSd: s.rangeScaleSd?.[row],
            score: s.score?.[row],
            beaconClass: s.beaconClass?.[row],
        });
    });
    return frames;
}

/** Lets the page be drawn. */
function breath() {
    return new Promise((resume) => setTimeout(resume));
}

class Replay {
    constructor(log, choices) {
        this.log = log;
        this.choices = choices;
        this.estimator = new Estimator();
        this.settings = coreSettings(this.estimator, log, choices);
        this.leadUs = this.settings.sighting_delay_us - log.robot.sighting_delay_us;
        this.estimator.begin(this.settings);
        this.frames = framesOf(log, choices);
        this.nextFrame = 0;
        this.ledger = new Ledger();
        this.refusals = {};
        this.poses = [];
        this.timesUs = stepTimesUs(log);
    }

    /** Feeds everything, as long as it is wanted; a frame goes in after the odometry that covers it. */
    async run(isWanted = () => true) {
        const { timeUs } = this.log.odometry;
        const isWheels = this.timesUs.length > timeUs.length;
        if (isWheels) {
            this.startClock(this.timesUs[0]);
        } else {
            this.read(0);
        }
        const first = isWheels ? 0 : 1;
        this.feedFrames(first < timeUs.length ? this.timesUs[0] : Infinity);
        this.keep(this.timesUs[0]);
        for (let row = first; row < timeUs.length; row++) {
            this.step(row, row === timeUs.length - 1);
            if (row % ROWS_AT_ONCE === 0) {
                await breath();
                if (!isWanted()) {
                    break;
                }
            }
        }
        return this;
    }

    step(row, isLast) {
        const nowUs = this.log.odometry.timeUs[row];
        const lastUs = this.timesUs[this.poses.length - 1];
        if (nowUs - lastUs > INTERRUPTION_US) {
            this.resume(lastUs, nowUs);
        }
        this.read(row);
        this.feedFrames(isLast ? Infinity : nowUs);
        this.keep(nowUs);
    }

    read(row) {
        const { kind, timeUs, a, b, gyro, gyroSd } = this.log.odometry;
        this.book(
            this.estimator.odometry(
                kind,
                timeUs[row],
                a[row],
                b[row],
                gyro?.[row] ?? NaN,
                gyroSd?.[row] ?? 0,
            ),
        );
    }

    book(isTaken) {
        if (!isTaken) {
            this.refusals[this.estimator.status] = (this.refusals[this.estimator.status] || 0) + 1;
        }
    }

    /** An empty frame if none is at the start, or nobody would know how long the first row took. */
    startClock(startUs) {
        while (this.nextFrame < this.frames.length && this.frames[this.nextFrame].timeUs < startUs) {
            this.nextFrame += 1;
            this.refusals["before the start"] = (this.refusals["before the start"] || 0) + 1;
        }
        if (this.frames[this.nextFrame]?.timeUs !== startUs) {
            this.book(this.estimator.frame(startUs, []));
        }
    }

    /** After an interruption of odometry, with a pose as doubtful as that makes it. */
    resume(lastUs, nextUs) {
        this.feedFrames(nextUs - 1);
        const positionSdM = Math.min(UNSEEN_SPEED_MPS * (nextUs - lastUs) * 1e-6, UNSEEN_POSITION_SD_MAX_M);
        this.book(this.estimator.resumeOdometry(positionSdM, UNSEEN_HEADING_SD_RAD));
    }

    feedFrames(untilUs) {
        while (this.nextFrame < this.frames.length && this.frames[this.nextFrame].timeUs <= untilUs) {
            const { timeUs, sightings } = this.frames[this.nextFrame++];
            const accounts = this.estimator.frame(timeUs, sightings);
            this.book(accounts);
            (accounts || []).forEach((account, index) => this.ledger.book(sightings[index].id, account));
        }
    }

    keep(timeUs) {
        const pose = this.estimator.pose();
        const past = this.leadUs ? this.poseInPast(timeUs - this.leadUs) : null;
        this.poses.push({ ...pose, ...past });
    }

    /** Commanded speeds run ahead of the motion. */
    poseInPast(timeUs) {
        return this.estimator.poseAt(timeUs) || (this.poses.length < 2 ? { x: 0, y: 0, theta: 0 } : null);
    }
}
