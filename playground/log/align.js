"use strict";
// Rotation and shift in the plane: host_sim/bslam/evaluation/align.py.

class Rigid {
    constructor(turn = 0, x = 0, y = 0) {
        Object.assign(this, { turn, x, y });
    }

    point(place) {
        const [c, s] = [Math.cos(this.turn), Math.sin(this.turn)];
        return { x: c * place.x - s * place.y + this.x, y: s * place.x + c * place.y + this.y };
    }

    pose(pose) {
        return { ...this.point(pose), theta: wrapRad(pose.theta + this.turn) };
    }

    get inverse() {
        const back = new Rigid(-this.turn).point(this);
        return new Rigid(-this.turn, -back.x, -back.y);
    }
}

/** What brings the places `moving` nearest to `fixed`: least squares over pairs. */
function fitRigid(moving, fixed) {
    if (moving.length === 0) {
        return new Rigid();
    }
    const [from, to] = [middleOf(moving), middleOf(fixed)];
    let [along, across] = [0, 0];
    moving.forEach((one, row) => {
        const [px, py] = [one.x - from.x, one.y - from.y];
        const [qx, qy] = [fixed[row].x - to.x, fixed[row].y - to.y];
        along += px * qx + py * qy;
        across += px * qy - py * qx;
    });
    const turned = new Rigid(Math.atan2(across, along));
    const middle = turned.point(from);
    return new Rigid(turned.turn, to.x - middle.x, to.y - middle.y);
}

function middleOf(places) {
    const mean = (axis) => places.reduce((sum, place) => sum + place[axis], 0) / places.length;
    return { x: mean("x"), y: mean("y") };
}
