"use strict";
// The room, the robot in it and what it measures. All in the frame of the robot's start: x forward, y left.

const ROOM = { left: -1.5, right: 9.5, bottom: -2.5, top: 5.5 };
const STEP_US = 40000;
const FRAME_STEPS = 2; // of odometry, from one frame to the next
const SPEED_MPS = 0.7;
const TURN_RADPS = 1.2;
const ACCELERATION_MPS2 = 1.5;
const TURN_ACCELERATION_RADPS2 = 6;
const BODY_M = 0.3;
const SEES_M = 7;
const SLIP_US = 1500000;
const SLIP_GRIP = 0.2; // share of the left wheel's travel that moves the robot while it slips

/** As the robot.toml of a log would describe it. */
function simulatedRobot(choices) {
    return {
        wheelbase_m: 0.4,
        wheel_speed_sigma_mps: choices.wheelNoise,
        step_us: STEP_US,
        field_of_view_rad: choices.fieldOfView,
        bearing_sigma_rad: 0.0136,
        range_sigma_fraction: 0.02,
        range_sigma_scale_m: 110.9,
        range_sigma_floor_m: 0.01,
        wheel_noise: "actuation",
    };
}

/** Where beacons stand: each the one of some random places that is farthest from those before it. */
function placeBeacons(random, count) {
    const beacons = [];
    const farFrom = (place) =>
        Math.min(
            Math.hypot(place.x, place.y),
            ...beacons.map((other) => Math.hypot(place.x - other.x, place.y - other.y)),
        );
    for (let id = 0; id < count; id++) {
        const places = Array.from({ length: 8 }, () => ({
            id,
            x: random.uniform(ROOM.left + 0.1, ROOM.right - 0.1),
            y: random.uniform(ROOM.bottom + 0.1, ROOM.top - 0.1),
        }));
        beacons.push(places.reduce((best, one) => (farFrom(one) > farFrom(best) ? one : best)));
    }
    return beacons;
}

function isInside(pose) {
    return (
        pose.x > ROOM.left + BODY_M &&
        pose.x < ROOM.right - BODY_M &&
        pose.y > ROOM.bottom + BODY_M &&
        pose.y < ROOM.top - BODY_M
    );
}

/** Goes from one random place to the next. */
class SelfDriver {
    constructor(random) {
        this.random = random;
        this.goal = { x: 3, y: 0 };
    }

    command(pose) {
        while (Math.hypot(this.goal.x - pose.x, this.goal.y - pose.y) < 0.4) {
            this.goal = {
                x: this.random.uniform(ROOM.left + 0.8, ROOM.right - 0.8),
                y: this.random.uniform(ROOM.bottom + 0.8, ROOM.top - 0.8),
            };
        }
        const off = wrapRad(Math.atan2(this.goal.y - pose.y, this.goal.x - pose.x) - pose.theta);
        const turn = limited(1.6 * off);
        return { forward: Math.abs(off) > 1 ? 0 : 1 - 0.5 * Math.abs(turn), turn };
    }
}

class World {
    constructor(choices) {
        const streams = [1, 2, 3, 4].map((stream) => new Random(4 * choices.seed + stream));
        [this.wheelRandom, this.sensorRandom, this.driveRandom] = streams;
        this.robot = simulatedRobot(choices);
        this.beacons = placeBeacons(streams[3], choices.beacons);
        this.hasRange = choices.observation === "distance";
        this.driver = new SelfDriver(this.driveRandom);
        this.pose = { x: 0, y: 0, theta: 0 };
        this.forwardMps = 0;
        this.turnRadps = 0;
        this.timeUs = 0;
        this.slipUntilUs = 0;
        this.step = 0;
    }

    /** Drives for a step. command: forward and turn, -1 to 1 each; null: the robot drives itself. */
    advance(command) {
        const wanted = command || this.driver.command(this.pose);
        this.step += 1;
        this.timeUs += STEP_US;
        const dt = 1e-6 * STEP_US;
        this.forwardMps = towards(this.forwardMps, SPEED_MPS * wanted.forward, ACCELERATION_MPS2 * dt);
        this.turnRadps = towards(this.turnRadps, TURN_RADPS * wanted.turn, TURN_ACCELERATION_RADPS2 * dt);
        const errors = [this.wheelError(), this.wheelError()];
        if (!isInside(this.moved(errors).pose)) {
            this.forwardMps = 0; // it stands at a wall, and its wheels do
        }
        const { pose, left, right } = this.moved(errors);
        this.pose = isInside(pose) ? pose : { ...this.pose, theta: pose.theta };
        return { timeUs: this.timeUs, left, right };
    }

    wheelError() {
        return this.robot.wheel_speed_sigma_mps * this.wheelRandom.normal();
    }

    /** The pose a step on, and what the encoders read. Wheels that turn err; the readings do not. */
    moved([leftError, rightError]) {
        const dt = 1e-6 * STEP_US;
        const half = 0.5 * this.robot.wheelbase_m * this.turnRadps;
        const [leftMps, rightMps] = [this.forwardMps - half, this.forwardMps + half];
        const grip = this.isSlipping ? SLIP_GRIP : 1;
        const left = dt * grip * (leftMps + (leftMps === 0 ? 0 : leftError));
        const right = dt * (rightMps + (rightMps === 0 ? 0 : rightError));
        const pose = afterArc(this.pose, 0.5 * (left + right), (right - left) / this.robot.wheelbase_m);
        return { pose, left: dt * leftMps, right: dt * rightMps };
    }

    get isSlipping() {
        return this.timeUs < this.slipUntilUs;
    }

    slip() {
        this.slipUntilUs = this.timeUs + SLIP_US;
    }

    /** To another place, without a turn of the wheels. */
    kidnap() {
        const from = this.pose;
        do {
            this.pose = {
                x: this.driveRandom.uniform(ROOM.left + 1, ROOM.right - 1),
                y: this.driveRandom.uniform(ROOM.bottom + 1, ROOM.top - 1),
                theta: this.driveRandom.uniform(-Math.PI, Math.PI),
            };
        } while (Math.hypot(this.pose.x - from.x, this.pose.y - from.y) < 3);
    }

    get isFrameDue() {
        return this.step % FRAME_STEPS === 0;
    }

    /** What the sensor sees now; `id` is the beacon's, which the estimator may or may not be told. */
    look() {
        const seen = [];
        for (const beacon of this.beacons) {
            const dx = beacon.x - this.pose.x;
            const dy = beacon.y - this.pose.y;
            const bearing = wrapRad(Math.atan2(dy, dx) - this.pose.theta);
            const range = Math.hypot(dx, dy);
            if (Math.abs(bearing) <= 0.5 * this.robot.field_of_view_rad && range < SEES_M && range > 0.05) {
                seen.push(this.measured(beacon.id, bearing, range));
            }
        }
        return seen;
    }

    measured(id, bearing, range) {
        const robot = this.robot;
        const sd = Math.hypot(
            robot.range_sigma_floor_m,
            robot.range_sigma_fraction * range,
            (range * range) / robot.range_sigma_scale_m,
        );
        const bearingRad = wrapRad(bearing + robot.bearing_sigma_rad * this.sensorRandom.normal());
        const rangeM = Math.max(range + sd * this.sensorRandom.normal(), 0.01);
        return { id, bearingRad, rangeM: this.hasRange ? rangeM : NaN };
    }
}

function limited(value) {
    return Math.max(-1, Math.min(1, value));
}

/** `value` moved towards `goal` by at most `step`. */
function towards(value, goal, step) {
    return value + Math.max(-step, Math.min(step, goal - value));
}
