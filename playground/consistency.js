"use strict";
// Errors and their size over what the filter says of itself: host_sim/bslam/evaluation/consistency.py.

const NEES_95 = 7.815; // chi-square, 3 degrees of freedom: 95 % of a consistent filter's lie below
const NEES_SINGULAR = 1e9;

/** Truth less estimate, x, y, theta. */
function errorStandard(estimate, truth) {
    return [truth.x - estimate.x, truth.y - estimate.y, wrapRad(truth.theta - estimate.theta)];
}

/** The motion that takes the estimate to the truth (right-invariant error). */
function errorInvariant(estimate, truth) {
    const angle = wrapRad(truth.theta - estimate.theta);
    const [c, s, half] = [Math.cos(angle), Math.sin(angle), 0.5 * angle];
    const dx = truth.x - (c * estimate.x - s * estimate.y);
    const dy = truth.y - (s * estimate.x + c * estimate.y);
    const hCotH = Math.abs(half) < 1e-6 ? 1 : half / Math.tan(half);
    return [hCotH * dx + half * dy, hCotH * dy - half * dx, angle];
}

/** Covariance of that error, as xx, yx, yy, tx, ty, tt, from the covariance of the plain difference. */
function covarianceInvariant(estimate, [xx, yx, yy, tx, ty, tt]) {
    const { x, y } = estimate;
    return [
        xx + 2 * y * tx + y * y * tt,
        yx - x * tx + y * ty - x * y * tt,
        yy - 2 * x * ty + x * x * tt,
        tx + y * tt,
        ty - x * tt,
        tt,
    ];
}

/** Normalised estimation error squared of the pose: 3 on average if the covariance is right. */
function poseNees(estimate, truth, filter) {
    const isStandard = filter === "standard";
    const error = isStandard ? errorStandard(estimate, truth) : errorInvariant(estimate, truth);
    const lower = isStandard ? estimate.lower : covarianceInvariant(estimate, estimate.lower);
    return Math.min(squaredOver(error, lower), NEES_SINGULAR);
}

/** e' P^-1 e by a Cholesky factor; NEES_SINGULAR for a P that is not positive definite. */
function squaredOver([e0, e1, e2], [xx, yx, yy, tx, ty, tt]) {
    const l00 = Math.sqrt(xx);
    const [l10, l20] = [yx / l00, tx / l00];
    const l11 = Math.sqrt(yy - l10 * l10);
    const l21 = (ty - l20 * l10) / l11;
    const l22 = Math.sqrt(tt - l20 * l20 - l21 * l21);
    const w0 = e0 / l00;
    const w1 = (e1 - l10 * w0) / l11;
    const w2 = (e2 - l20 * w0 - l21 * w1) / l22;
    const squared = w0 * w0 + w1 * w1 + w2 * w2;
    return l00 > 0 && l11 > 0 && l22 > 0 && Number.isFinite(squared) ? squared : NEES_SINGULAR;
}

/** A pose without its heading. */
function gaussianOf({ x, y, lower: [xx, xy, yy] }) {
    return { x, y, xx, xy, yy };
}

/** Half axes and turn of the ellipse that holds 95 %. */
function ellipse95({ xx, xy, yy }) {
    const scale = 5.991; // chi-square, 2 degrees of freedom
    const middle = 0.5 * (xx + yy);
    const off = Math.hypot(0.5 * (xx - yy), xy);
    return {
        major: Math.sqrt(scale * Math.max(middle + off, 0)),
        minor: Math.sqrt(scale * Math.max(middle - off, 0)),
        turn: 0.5 * Math.atan2(2 * xy, xx - yy),
    };
}
