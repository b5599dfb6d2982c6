"use strict";

const PATH_POINTS_MAX = 6000;
const KEPT_ROWS = 1500; // of errors, to be drawn: a minute
const NEES_FIRST_STEP = 51; // by then the pose's covariance has left its start value of 0

/** Points of a path; where they become too many, every other one goes. */
class Path {
    constructor() {
        this.points = [];
        this.every = 1;
        this.count = 0;
    }

    add(point) {
        if (this.count++ % this.every === 0) {
            this.points.push(point);
        }
        if (this.points.length > PATH_POINTS_MAX) {
            this.points = this.points.filter((_, index) => index % 2 === 0);
            this.every *= 2;
        }
    }
}

/** Mean of the numbers that are finite. */
class Mean {
    constructor() {
        this.sum = 0;
        this.count = 0;
    }

    add(value) {
        if (Number.isFinite(value)) {
            this.sum += value;
            this.count += 1;
        }
    }

    get value() {
        return this.sum / this.count;
    }
}

/** A simulated drive with the estimator beside it. */
class Drive {
    constructor(choices) {
        this.choices = choices;
        this.world = new World(choices);
        this.estimator = new Estimator();
        const toldSigma = this.world.robot.wheel_speed_sigma_mps * choices.toldNoise;
        const log = {
            robot: { ...this.world.robot, wheel_speed_sigma_mps: toldSigma },
            odometry: { kind: "wheels", timeUs: [0, STEP_US] },
            sightings: {},
        };
        this.settings = coreSettings(this.estimator, log, { ...choices, recovery: true });
        this.estimator.begin(this.settings);
        this.estimator.inputs = choices.keepsInputs ? [] : null;
        this.ledger = new Ledger();
        this.truePath = new Path();
        this.path = new Path();
        this.odometryPath = new Path();
        this.odometryPose = { x: 0, y: 0, theta: 0 };
        this.errors = []; // a row a step of the last while: time, error, NEES
        this.meanError = new Mean();
        this.meanNees = new Mean();
        this.sightings = [];
        this.beacons = [];
        this.begin();
    }

    begin() {
        this.estimator.frame(0, this.asTold(this.world.look()));
        this.pose = this.estimator.pose();
        this.truePath.add(this.world.pose);
        this.path.add(this.pose);
        this.odometryPath.add(this.odometryPose);
    }

    /** Sightings as the estimator gets them: with their identity only under known data association. */
    asTold(seen) {
        const isKnown = this.choices.association === "known";
        return seen.map((one) => ({ ...one, label: isKnown ? one.id : -1 }));
    }

    step(command) {
        const reading = this.world.advance(command);
        this.estimator.odometry("wheels", reading.timeUs, reading.left, reading.right);
        this.follow(reading);
        if (this.world.isFrameDue) {
            this.look(reading.timeUs);
        }
        this.pose = this.estimator.pose();
        this.truePath.add(this.world.pose);
        this.path.add(this.pose);
        this.judge();
    }

    /** Odometry alone, to compare with. */
    follow({ left, right }) {
        const turn = (right - left) / this.world.robot.wheelbase_m;
        this.odometryPose = afterArc(this.odometryPose, 0.5 * (left + right), turn);
        this.odometryPath.add(this.odometryPose);
    }

    /** To another place, which odometry does not see. */
    kidnap() {
        this.world.kidnap();
        this.truePath.add({ x: NaN, y: NaN }); // no line leads there
    }

    look(timeUs) {
        const seen = this.world.look();
        const accounts = this.estimator.frame(timeUs, this.asTold(seen));
        this.sightings = seen.map((one, index) => ({
            ...one,
            reason: accounts ? accounts[index].reason : this.estimator.status,
            verdict: accounts ? this.ledger.book(one.id, accounts[index]) : "rejected",
        }));
        this.beacons = this.estimator.beacons();
    }

    judge() {
        const truth = this.world.pose;
        const error = Math.hypot(truth.x - this.pose.x, truth.y - this.pose.y);
        const isEarly = this.world.step < NEES_FIRST_STEP;
        const nees = isEarly ? NaN : poseNees(this.pose, truth, this.choices.filter);
        this.errors.push([1e-6 * this.world.timeUs, error, nees]);
        this.meanError.add(error);
        this.meanNees.add(nees);
        if (this.errors.length > 2 * KEPT_ROWS) {
            this.errors = this.errors.slice(-KEPT_ROWS);
        }
    }
}
