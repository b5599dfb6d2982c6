"use strict";

const PLOT_EDGE = { left: 44, right: 10, top: 20, bottom: 18 };

/** Error and NEES over time, one above the other. rows: time s, error m, NEES. */
function drawPlots(canvas, rows) {
    const colours = themeColours();
    const { pen, width, height } = freshCanvas(canvas, colours);
    pen.font = "12px system-ui, sans-serif";
    const half = 0.5 * height;
    const times = rows.length ? [rows[0][0], Math.max(rows[rows.length - 1][0], rows[0][0] + 1)] : [0, 1];
    const highest = Math.max(0.1, ...rows.map((row) => row[1]).filter(Number.isFinite));
    const titled = (column, name, meaning) =>
        name + (rows.some((row) => Number.isFinite(row[column])) ? meaning : ": no truth");
    const error = {
        title: titled(1, "error of the position", ", m"),
        column: 1,
        low: 0,
        high: 1.08 * highest,
        marks: [],
    };
    const nees = {
        title: titled(2, "NEES", " (3 is right, 95 % below the dashes)"),
        column: 2,
        low: -1.3,
        high: 3.3,
        marks: [NEES_95],
        isLog: true,
    };
    drawPanel(pen, colours, { x: 0, y: 0, width, height: half }, times, rows, error);
    drawPanel(pen, colours, { x: 0, y: half, width, height: half }, times, rows, nees);
}

function drawPanel(pen, colours, area, [first, last], rows, panel) {
    const inner = {
        left: area.x + PLOT_EDGE.left,
        right: area.x + area.width - PLOT_EDGE.right,
        top: area.y + PLOT_EDGE.top,
        bottom: area.y + area.height - PLOT_EDGE.bottom,
    };
    const level = (value) => (panel.isLog ? Math.log10(Math.max(value, 1e-9)) : value);
    const x = (time) => inner.left + ((inner.right - inner.left) * (time - first)) / (last - first);
    const y = (value) => {
        const share = (level(value) - panel.low) / (panel.high - panel.low);
        return inner.bottom - (inner.bottom - inner.top) * Math.max(0, Math.min(1, share));
    };
    drawAxes(pen, colours, inner, panel, y, [first, last]);
    pen.strokeStyle = colours.estimate;
    pen.lineWidth = 1.5;
    pen.beginPath();
    let isDown = false;
    for (const row of rows) {
        const isKnown = Number.isFinite(row[panel.column]);
        if (isKnown) {
            pen[isDown ? "lineTo" : "moveTo"](x(row[0]), y(row[panel.column]));
        }
        isDown = isKnown;
    }
    pen.stroke();
}

function drawAxes(pen, colours, inner, panel, y, [first, last]) {
    pen.fillStyle = colours.ink;
    pen.textAlign = "left";
    pen.fillText(panel.title, inner.left, inner.top - 7);
    pen.fillStyle = colours.quiet;
    pen.fillText(`${first.toFixed(0)} s`, inner.left, inner.bottom + 14);
    pen.textAlign = "right";
    pen.fillText(`${last.toFixed(0)} s`, inner.right, inner.bottom + 14);
    pen.lineWidth = 1;
    pen.strokeStyle = colours.line;
    for (const tick of panel.isLog ? [0.1, 1, 10, 100, 1000] : ticksTo(panel.high)) {
        pen.fillText(String(tick), inner.left - 6, y(tick) + 4);
        rule(pen, inner, y(tick));
    }
    pen.setLineDash([6, 4]);
    pen.strokeStyle = colours.truth;
    panel.marks.forEach((mark) => rule(pen, inner, y(mark)));
    pen.setLineDash([]);
}

function rule(pen, inner, py) {
    pen.beginPath();
    pen.moveTo(inner.left, py);
    pen.lineTo(inner.right, py);
    pen.stroke();
}

/** Two or three round numbers from 0 on. */
function ticksTo(high) {
    const power = 10 ** Math.floor(Math.log10(high));
    const step = [0.5, 1, 2, 5].map((part) => part * power).find((one) => high / one < 3.5);
    return Array.from({ length: Math.floor(high / step) + 1 }, (_, index) =>
        Number((index * step).toPrecision(3)),
    );
}
