"use strict";

/** What is left of a division, not negative for a divisor above 0. */
function floorMod(value, divisor) {
    const left = value % divisor;
    return left < 0 ? left + divisor : left;
}

/** The same angle in (-pi, pi]; one that is there already stays to the last bit. */
function wrapRad(angle) {
    return angle > -Math.PI && angle <= Math.PI ? angle : Math.PI - floorMod(Math.PI - angle, 2 * Math.PI);
}

/** sin(x) / x. */
function sinc(x) {
    return x === 0 ? 1 : Math.sin(x) / x;
}

/** A pose after an exact arc of this length and turn. */
function afterArc(pose, forward, turn) {
    const chord = forward * sinc(0.5 * turn);
    const course = pose.theta + 0.5 * turn;
    return {
        x: pose.x + chord * Math.cos(course),
        y: pose.y + chord * Math.sin(course),
        theta: wrapRad(pose.theta + turn),
    };
}

function median(values) {
    const sorted = Float64Array.from(values).sort();
    const middle = sorted.length >> 1;
    return sorted.length % 2 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
}
