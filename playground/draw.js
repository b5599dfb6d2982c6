"use strict";
// The map on its canvas. A scene: bounds, path, truePath, odometryPath, beacons, trueBeacons, and perhaps
// walls, pose, truePose, sightings.

const COLOURS = [
    "paper",
    "ink",
    "quiet",
    "line",
    "truth",
    "estimate",
    "odometry",
    "right",
    "wrong",
    "new",
    "rejected",
];

/** The colours of style.css, so that lines and legend agree. */
function themeColours() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** A canvas as sharp as the screen, cleared; its width and height in CSS pixels stand beside. */
function freshCanvas(canvas, colours) {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = colours.paper;
    pen.fillRect(0, 0, width, height);
    return { pen, width, height };
}

class MapView {
    constructor(canvas, scene) {
        this.colours = themeColours();
        Object.assign(this, freshCanvas(canvas, this.colours));
        const { left, right, bottom, top } = scene.bounds;
        const margin = 14;
        const [across, along] = [this.width - 2 * margin, this.height - 2 * margin];
        this.scale = Math.min(across / (right - left), along / (top - bottom));
        this.shiftX = 0.5 * (this.width - this.scale * (left + right));
        this.shiftY = 0.5 * (this.height + this.scale * (bottom + top));
        this.pen.font = "12px system-ui, sans-serif";
        this.draw(scene);
    }

    x(metres) {
        return this.shiftX + this.scale * metres;
    }

    y(metres) {
        return this.shiftY - this.scale * metres;
    }

    draw(scene) {
        if (scene.walls) {
            this.drawWalls(scene.walls);
        }
        this.drawPath(scene.odometryPath, this.colours.odometry, 1.5, [5, 4]);
        this.drawPath(scene.truePath, this.colours.truth, 2.5);
        this.drawPath(scene.path, this.colours.estimate, 1.8);
        for (const sighting of scene.sightings || []) {
            this.drawSighting(sighting, scene.pose);
        }
        scene.trueBeacons.forEach((beacon) => this.drawTrueBeacon(beacon));
        scene.beacons.forEach((beacon) => this.drawBeacon(beacon));
        if (scene.truePose) {
            this.drawRobot(scene.truePose, this.colours.truth);
        }
        if (scene.pose) {
            this.drawEllipse(gaussianOf(scene.pose), this.colours.estimate);
            this.drawRobot(scene.pose, this.colours.estimate);
        }
        this.writeNames(scene);
    }

    /** On top of all else. */
    writeNames({ trueBeacons, beacons }) {
        for (const { name, x, y } of trueBeacons) {
            this.write(name, this.x(x) + 9, this.y(y) + 4, this.colours.truth);
        }
        for (const { name, x, y, confirmed } of beacons) {
            const colour = confirmed ? this.colours.estimate : this.colours.ink;
            this.write(name, this.x(x) - 8, this.y(y) - 8, colour, "right");
        }
    }

    drawWalls({ left, right, bottom, top }) {
        this.pen.strokeStyle = this.colours.quiet;
        this.pen.lineWidth = 3;
        const size = [this.scale * (right - left), this.scale * (top - bottom)];
        this.pen.strokeRect(this.x(left), this.y(top), ...size);
    }

    drawPath(points, colour, width, dashes = []) {
        this.stroke(colour, width, dashes, () => {
            let isDown = false;
            for (const point of points) {
                const isKnown = Number.isFinite(point.x);
                if (isKnown) {
                    this.pen[isDown ? "lineTo" : "moveTo"](this.x(point.x), this.y(point.y));
                }
                isDown = isKnown;
            }
        });
    }

    stroke(colour, width, dashes, trace) {
        const pen = this.pen;
        pen.strokeStyle = colour;
        pen.lineWidth = width;
        pen.setLineDash(dashes);
        pen.beginPath();
        trace();
        pen.stroke();
        pen.setLineDash([]);
    }

    /** From the estimated pose to where the sighting has the beacon; bearing-only: as far as one sees. */
    drawSighting(sighting, pose) {
        const range = Number.isFinite(sighting.rangeM) ? sighting.rangeM : SEES_M;
        const course = pose.theta + sighting.bearingRad;
        const dashes = sighting.verdict === "rejected" ? [4, 4] : [];
        this.stroke(this.colours[sighting.verdict], sighting.verdict === "right" ? 1.2 : 2.2, dashes, () => {
            this.pen.moveTo(this.x(pose.x), this.y(pose.y));
            const [x, y] = [pose.x + range * Math.cos(course), pose.y + range * Math.sin(course)];
            this.pen.lineTo(this.x(x), this.y(y));
        });
    }

    drawTrueBeacon({ x, y }) {
        const [px, py] = [this.x(x), this.y(y)];
        this.stroke(this.colours.truth, 2, [], () => {
            this.pen.moveTo(px, py - 6);
            this.pen.lineTo(px + 6, py);
            this.pen.lineTo(px, py + 6);
            this.pen.lineTo(px - 6, py);
            this.pen.closePath();
        });
    }

    drawBeacon(beacon) {
        const [px, py] = [this.x(beacon.x), this.y(beacon.y)];
        const colour = beacon.confirmed ? this.colours.estimate : this.colours.new;
        this.drawEllipse(beacon, colour);
        this.stroke(colour, 2, [], () => {
            this.pen.moveTo(px - 3, py);
            this.pen.lineTo(px + 3, py);
            this.pen.moveTo(px, py - 3);
            this.pen.lineTo(px, py + 3);
        });
    }

    /** With a rim of paper, so that it can be read on a line. */
    write(text, px, py, colour, side = "left") {
        this.pen.textAlign = side;
        this.pen.strokeStyle = this.colours.paper;
        this.pen.lineWidth = 3;
        this.pen.lineJoin = "round";
        this.pen.strokeText(text, px, py);
        this.pen.fillStyle = colour;
        this.pen.fillText(text, px, py);
    }

    drawEllipse(gaussian, colour) {
        const { major, minor, turn } = ellipse95(gaussian);
        if (!(major * this.scale < 1e5)) {
            return; // as wide as the page and more
        }
        this.stroke(colour, 1.3, [], () => {
            const centre = [this.x(gaussian.x), this.y(gaussian.y)];
            this.pen.ellipse(...centre, this.scale * major, this.scale * minor, -turn, 0, 2 * Math.PI);
        });
    }

    drawRobot(pose, colour) {
        const size = Math.max(0.22 * this.scale, 8);
        const corner = (angle, share) => [
            this.x(pose.x) + size * share * Math.cos(pose.theta + angle),
            this.y(pose.y) - size * share * Math.sin(pose.theta + angle),
        ];
        this.stroke(colour, 2.5, [], () => {
            this.pen.moveTo(...corner(0, 1.3));
            this.pen.lineTo(...corner(2.5, 1));
            this.pen.lineTo(...corner(-2.5, 1));
            this.pen.closePath();
        });
    }
}
