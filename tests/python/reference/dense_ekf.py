"""The filter once more, as a textbook has it: dense matrices, full covariance, nothing deferred, in double.

Written from the paper's equations (1)-(11) and from the definition of the right-invariant error, not from
the C code. No derivative is written down: each function of the state stands here as it is, and its Jacobian
in the error's own coordinates comes from complex steps, exact to rounding. What agrees with this is right
for reasons of its own.

The state vector: x, y, theta | v and omega, or their scale factors, where switched on | beacons in the
order in which they came, (x, y) for a point, (x, y, scale) for a sized one, whose distances are measured
scale times as long as they are, and (anchor x, anchor y, direction, inverse distance) for a
ray. Units m, rad, s.

Coordinates of the error e of a state X, estimated as X̂:
    standard   X = X̂ + e
    invariant  X = exp(e) X̂: the map turns by e's angle a about the origin, and each position p goes to
               R(a) p + V(a) e_p; a ray's direction turns along, everything else is added.

Conventions that the C core documents: all sightings of a frame are linearised at the estimate before the
frame, and the estimate moves once at its end; then new beacons are added in the frame's order, and rays
that are linear enough become points. Where things have scales, a point that is seen with a distance has one
from then on, and a ray becomes a sized point where on it the distance ends, which is then used up; that
comes before the frame's linearisation. There is no delay here: what came late is fed in the order of time.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Pose = Sequence[float]
"""x, y, yaw: m, rad."""

X, Y, THETA, FORWARD, TURN = range(5)
BENT_HEADING_VAR_RAD2 = 0.0027
STEP = 1e-30
"""Of the complex derivative: its square vanishes beside 1, so that the result is exact to rounding."""

NO_NOISE: Matrix = np.zeros((0, 0))

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Motion:
    """An odometry increment: way and turn (m, rad), their covariance (2, 2), duration."""

    dt_s: float
    forward_m: float
    turn_rad: float
    covariance: Matrix


@dataclass(frozen=True)
class Sighting:
    """A beacon seen: its label, direction in the sensor's frame, distance or None."""

    label: int
    bearing_rad: float
    range_m: float | None


@dataclass
class Beacon:
    """A beacon of the map: "point", "sized" or "ray" with its state values' count; "known" with its place."""

    label: int
    kind: str
    place: tuple[float, float] = (0.0, 0.0)

    @property
    def size(self) -> int:
        return {"point": 2, "sized": 3, "ray": 4, "known": 0}[self.kind]


def wrap(angle_rad: float) -> float:
    """The same direction in [-pi, pi]."""
    return float(np.remainder(angle_rad + np.pi, 2 * np.pi) - np.pi)


def motion_of_wheels(params: Mapping[str, float], left_m: float, right_m: float, dt_s: float) -> Motion:
    """The increment of a robot whose wheels went so far, each with an error that is independent of the
    other's.
    """
    to_body = np.array([[0.5, 0.5], [-1 / params["wheelbase_m"], 1 / params["wheelbase_m"]]])
    forward_m, turn_rad = to_body @ [left_m, right_m]
    growth = params["travel_sd_per_sqrt_m"] ** 2
    wheels = np.diag(
        [
            (params["left_speed_sd_mps"] * dt_s) ** 2 + growth * abs(left_m),
            (params["right_speed_sd_mps"] * dt_s) ** 2 + growth * abs(right_m),
        ]
    )
    moving_s = dt_s if forward_m or turn_rad else 0.0
    body = np.diag(
        [
            params["forward_sd_per_sqrt_s"] ** 2 * moving_s
            + params["forward_sd_per_sqrt_m"] ** 2 * abs(forward_m),
            params["turn_sd_per_sqrt_s"] ** 2 * moving_s
            + params["turn_sd_per_sqrt_m"] ** 2 * abs(forward_m)
            + params["turn_sd_per_sqrt_rad"] ** 2 * abs(turn_rad),
        ]
    )
    return Motion(dt_s, float(forward_m), float(turn_rad), to_body @ wheels @ to_body.T + body)


def _turned(angle, x, y):  # type: ignore[no-untyped-def]
    """(x, y) turned by an angle; any of them complex, or arrays."""
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


def _direction(dx, dy):  # type: ignore[no-untyped-def]
    """The angle of (dx, dy), with the derivative of a complex step carried along."""
    slope = (np.real(dx) * np.imag(dy) - np.real(dy) * np.imag(dx)) / (np.real(dx) ** 2 + np.real(dy) ** 2)
    return np.arctan2(np.real(dy), np.real(dx)) + 1j * slope


class DenseEkf:
    """One estimate: `mean` (n,), `own_covariance` (n, n) in the error's own coordinates, `beacons`."""

    def __init__(self, params: Mapping[str, float]) -> None:
        """params: by the names of the C parameters; every one that applies must be there."""
        self.params = params
        self.invariant = params["filter"] == 1
        self.beacons: list[Beacon] = []
        extra: list[float] = []
        sds: list[float] = []
        if params["velocity_states"]:
            extra, sds = [0.0, 0.0], [params["velocity_sd_mps"], params["turn_rate_sd_radps"]]
        elif params["scale_states"]:
            extra, sds = [params["forward_scale"], params["turn_scale"]], [params["scale_sd"]] * 2
        self.mean: Vector = np.array([0.0, 0.0, 0.0, *extra])
        self.own_covariance: Matrix = np.diag([0.0, 0.0, 0.0, *(sd**2 for sd in sds)])
        self.base = len(self.mean)
        self.autocorrelation = np.zeros((2, 2))  # bearings, ranges: sums of products and of squares
        self.last: dict[
            int, list[float]
        ] = {}  # label: innovations of bearing and range, in standard deviations of their noise

    # ---- places in the state -------------------------------------------------------------------------------

    def at(self, index: int) -> int:
        """Where beacon `index` of the list begins in the state."""
        return self.base + sum(beacon.size for beacon in self.beacons[:index])

    def find(self, label: int) -> int | None:
        """The place in the list of the beacon with this label."""
        labels = [beacon.label for beacon in self.beacons]
        return labels.index(label) if label in labels else None

    def _positions(self) -> list[int]:
        """Where positions begin: the robot's, points, anchors."""
        return [X, *(self.at(i) for i, beacon in enumerate(self.beacons) if beacon.kind != "known")]

    def _directions(self) -> list[int]:
        """Where rays have their direction."""
        return [self.at(i) + 2 for i, beacon in enumerate(self.beacons) if beacon.kind == "ray"]

    def angles(self) -> list[int]:
        """Which values of the state are angles."""
        return [THETA, *self._directions()]

    # ---- the error's coordinates ---------------------------------------------------------------------------

    def _varied(self, extra: int = 0):  # type: ignore[no-untyped-def]
        """States X̂ "plus" i STEP in each coordinate of the error in turn, one a column, and noises likewise.

        Returns (n, n + extra) and (extra, n + extra). To first order V(a) is 1 and need not be there.
        """
        n = len(self.mean)
        error = 1j * STEP * np.eye(n, n + extra)
        noise = 1j * STEP * np.eye(extra, n + extra, n)
        state = self.mean[:, None] + error
        if self.invariant:
            angle = error[THETA]
            for i in self._positions():
                turned = _turned(angle, self.mean[i], self.mean[i + 1])
                state[i], state[i + 1] = turned[0] + error[i], turned[1] + error[i + 1]
            for i in self._directions():
                state[i] += angle
        return state, noise

    def _error_of(self, state) -> Matrix:  # type: ignore[no-untyped-def]
        """Derivatives of the error by what was varied: (n, columns), for states around the present mean."""
        error = state - self.mean[:, None]
        if self.invariant:
            angle = error[THETA]
            for i in self._positions():
                turned = _turned(angle, self.mean[i], self.mean[i + 1])
                error[i], error[i + 1] = state[i] - turned[0], state[i + 1] - turned[1]
            for i in self._directions():
                error[i] = error[i] - angle
        return np.imag(error) / STEP

    def _move(self, error: Vector) -> None:
        """The mean goes to where a finite error says."""
        before = self.mean.copy()
        self.mean = before + error
        if self.invariant:
            angle = error[THETA]
            # V(a): the mean of R over the turn.
            turns = angle * (GAUSS_NODES + 1) / 2
            v_cos, v_sin = GAUSS_WEIGHTS @ np.cos(turns) / 2, GAUSS_WEIGHTS @ np.sin(turns) / 2
            for i in self._positions():
                dx, dy = error[i], error[i + 1]
                x, y = _turned(angle, before[i], before[i + 1])
                self.mean[i : i + 2] = x + v_cos * dx - v_sin * dy, y + v_sin * dx + v_cos * dy
            self.mean[self._directions()] += angle
        self._wrap()

    def _wrap(self) -> None:
        for i in self.angles():
            self.mean[i] = wrap(self.mean[i])

    @property
    def covariance(self) -> Matrix:
        """(n, n), of X - X̂: in ordinary coordinates whatever the filter."""
        varied, _ = self._varied()
        to_ordinary = np.imag(varied) / STEP
        return to_ordinary @ self.own_covariance @ to_ordinary.T

    def _change(
        self, function: Callable[..., object], noise: Matrix = NO_NOISE, beacons: list[Beacon] | None = None
    ) -> None:
        """X -> function(X, w) with w of covariance `noise`: equations (4) and (5), for any change of the
        state.

        function takes the state (n, columns) and the noises (m, columns) and returns the new state's rows,
        in which stand `beacons`, where they are not the same as before.
        """
        n, m = len(self.mean), len(noise)
        varied, noises = self._varied(m)
        joint = np.block([[self.own_covariance, np.zeros((n, m))], [np.zeros((m, n)), noise]])
        here = np.array(function(self.mean[:, None] + 0j, np.zeros((m, 1), complex)))
        there = np.array(function(varied, noises))
        self.beacons = self.beacons if beacons is None else beacons
        self.mean = np.real(here[:, 0])
        jacobian = self._error_of(there)
        self.own_covariance = jacobian @ joint @ jacobian.T
        self._wrap()

    # ---- time ----------------------------------------------------------------------------------------------

    def predict(self, motion: Motion) -> None:
        """One odometry increment: equations (2), (4), (5); with velocity states it is a measurement."""
        p = self.params
        dt_s = motion.dt_s
        if p["velocity_states"]:
            self._walk(
                [1 / (1 + dt_s / p["velocity_decay_s"]), 1 / (1 + dt_s / p["turn_rate_decay_s"])],
                [p["velocity_walk_mps_sqrt_s"], p["turn_rate_walk_radps_sqrt_s"]],
                dt_s,
            )
            self._drive(lambda s, w: (s[FORWARD] * dt_s, s[TURN] * dt_s), NO_NOISE)
            self._measure_velocity(motion)
            return
        if p["scale_states"]:
            self._walk([1.0, 1.0], [p["scale_walk_sqrt_s"]] * 2, dt_s)
            self._drive(
                lambda s, w: (s[FORWARD] * motion.forward_m + w[0], s[TURN] * motion.turn_rad + w[1]),
                motion.covariance,
            )
        else:
            scales = p["forward_scale"], p["turn_scale"]
            self._drive(
                lambda s, w: (scales[0] * motion.forward_m + w[0], scales[1] * motion.turn_rad + w[1]),
                motion.covariance,
            )

    def _walk(self, keep: Sequence[float], walk: Sequence[float], dt_s: float) -> None:
        """The two further states forget a share and take a random step."""

        def changed(state, noise):  # type: ignore[no-untyped-def]
            further = [keep[k] * state[FORWARD + k] + noise[k] for k in range(2)]
            return [*state[:FORWARD], *further, *state[TURN + 1 :]]

        self._change(changed, np.diag([step**2 * dt_s for step in walk]))

    def _drive(self, increment: Callable[..., tuple[object, object]], noise: Matrix) -> None:
        """The pose moves by an increment (way, turn) that depends on the state and on noise."""

        def changed(state, noises):  # type: ignore[no-untyped-def]
            forward_m, turn_rad = increment(state, noises)
            c, s = self._way(state[THETA], turn_rad)
            pose = [state[X] + forward_m * c, state[Y] + forward_m * s, state[THETA] + turn_rad]
            return [*pose, *state[FORWARD:]]

        self._change(changed, noise)

    def _way(self, theta, turn_rad):  # type: ignore[no-untyped-def]
        """Where one metre forward leads while turning: (x, y)."""
        if self.params["motion"] == 0:
            return np.cos(theta), np.sin(theta)
        # The mean direction over the turn, by quadrature: exact to rounding for turns below 4 rad.
        turns = theta + turn_rad * (GAUSS_NODES[:, None] + 1) / 2
        return GAUSS_WEIGHTS @ np.cos(turns) / 2, GAUSS_WEIGHTS @ np.sin(turns) / 2

    def _measure_velocity(self, motion: Motion) -> None:
        varied, _ = self._varied()
        rows = np.imag(varied[[FORWARD, TURN]]) / STEP
        scaled = [
            self.params["forward_scale"] * motion.forward_m / motion.dt_s,
            self.params["turn_scale"] * motion.turn_rad / motion.dt_s,
        ]
        self._move(
            self._update(
                rows, np.array(scaled) - self.mean[[FORWARD, TURN]], motion.covariance / motion.dt_s**2
            )
        )

    # ---- sightings -----------------------------------------------------------------------------------------

    def _update(self, rows: Matrix, innovation: Vector, noise: Matrix) -> Vector:
        """Equations (8), (9), (11); returns the correction of equation (10), which is for the caller to
        apply.
        """
        p = self.own_covariance
        s = rows @ p @ rows.T + noise
        gain = np.linalg.solve(s, rows @ p).T
        kept = (np.eye(len(p)) - gain @ rows) @ p
        self.own_covariance = (kept + kept.T) / 2
        return gain @ innovation

    def _seen(self, state, index: int, mount: Pose):  # type: ignore[no-untyped-def]
        """How beacon `index` looks to the sensor: distance, direction, log of the length."""
        beacon, at = self.beacons[index], self.at(index)
        mount_x, mount_y, yaw = mount
        offset_x, offset_y = _turned(state[THETA], mount_x, mount_y)
        sensor_x, sensor_y = state[X] + offset_x, state[Y] + offset_y
        if beacon.kind == "ray":
            # Seen along g = inverse distance * (anchor - sensor) + direction, which is finite for a far
            # beacon too.
            inverse = state[at + 3]
            dx = inverse * (state[at] - sensor_x) + np.cos(state[at + 2])
            dy = inverse * (state[at + 1] - sensor_y) + np.sin(state[at + 2])
            length = np.sqrt(dx * dx + dy * dy)
            range_m = length / inverse
        else:
            known = beacon.kind == "known"
            dx = (beacon.place[0] if known else state[at]) - sensor_x
            dy = (beacon.place[1] if known else state[at + 1]) - sensor_y
            length = np.sqrt(dx * dx + dy * dy)
            range_m = length * state[at + 2] if beacon.kind == "sized" else length
        return range_m, _direction(dx, dy) - state[THETA] - yaw, np.log(length)

    def measurement(
        self, sighting: Sighting, index: int, mount: Pose
    ) -> tuple[list[Vector], list[float], list[float]]:
        """Rows of H, innovations and variances of one sighting, at the present estimate."""
        varied, _ = self._varied()
        seen = self._seen(varied, index, mount)
        range_row, bearing_row, length_row = (np.imag(value) / STEP for value in seen)
        range_m, bearing_rad = float(np.real(seen[0][0])), float(np.real(seen[1][0]))
        p = self.params
        bearing_var = p["bearing_sd_rad"] ** 2
        bearing = wrap(sighting.bearing_rad - bearing_rad)
        if sighting.range_m is not None:
            common = 0.0 if self.beacons[index].kind == "sized" else p["range_scale_sd"] * range_m
            variances = [bearing_var, self._range_variance(range_m) + common**2]
            bent = self._bent(varied, range_row, bearing_row, range_m)
            variances = [own + more for own, more in zip(variances, bent, strict=True)]
            return [bearing_row, range_row], [bearing, sighting.range_m - range_m], variances
        # The bend of the model, to second order: half the trace of (Hessian P)² of a complex logarithm.
        joint = np.array([length_row, bearing_row])
        (length_var, cross), (_, direction_var) = joint @ self.own_covariance @ joint.T
        bend = length_var * direction_var + cross**2
        variance = bearing_var * p["bearing_only_variance_factor"] + p["bearing_only_curvature_factor"] * bend
        return [bearing_row], [bearing], [variance]

    def _bent(self, varied, range_row: Vector, bearing_row: Vector, range_m: float) -> list[float]:  # type: ignore[no-untyped-def]
        """What a heading in doubt adds to the variances of direction and distance, MATH (46)."""
        heading_row = np.imag(varied[THETA]) / STEP
        with_heading = self.own_covariance @ heading_row
        variance = float(heading_row @ with_heading)
        if not self.invariant or variance < BENT_HEADING_VAR_RAD2:
            return [0.0, 0.0]
        along_m, turn_rad2 = float(range_row @ with_heading), float(bearing_row @ with_heading)
        turn = turn_rad2 / variance
        return [
            0.75 * (along_m / range_m * (1 + 2 * turn)) ** 2,
            0.75 * (range_m * turn_rad2 * (1 + turn)) ** 2,
        ]

    def _range_variance(self, range_m: float) -> float:
        p = self.params
        parts = p["range_sd_floor_m"], p["range_sd_fraction"] * range_m, p["range_sd_per_m"] * range_m**2
        return sum(part**2 for part in parts)

    def frame(
        self,
        sightings: Sequence[Sighting],
        mount: Pose = (0.0, 0.0, 0.0),
    ) -> None:
        """One image: fuses what the map holds as one batch, adds the rest, turns rays into points.

        mount: the sensor's pose on the robot.
        """
        used = [self._begin_scale(sighting, mount) for sighting in sightings]
        measurements = []
        for sighting, is_used in zip(sightings, used, strict=True):
            index = self.find(sighting.label)
            if index is not None:
                parts = self.measurement(sighting, index, mount)
                measurements.append((sighting.label, tuple(part[:1] for part in parts) if is_used else parts))
        if measurements:
            measurements = self._coloured(measurements)
            self._move(self._update_all(measurements))
        for sighting in sightings:
            if self.find(sighting.label) is None:
                self.add(sighting, mount)
        for index in reversed(range(len(self.beacons))):
            self._settle(index, mount)

    def _coloured(self, measurements):  # type: ignore[no-untyped-def]
        """Variances as large as the noise of late was like that before it: (1 + r) / (1 - r) times."""
        if self.params["correlation_m"] >= 0:
            return [parts for _, parts in measurements]
        product, square = self.autocorrelation.T
        r = np.clip(product / (square + 30.0), 0.0, 0.98)
        factor, counts, widened = (1 + r) / (1 - r), np.zeros(2), []
        for label, (rows, innovations, variances) in measurements:
            last = self.last.setdefault(label, [0.0, 0.0])
            for k, (innovation, variance) in enumerate(zip(innovations, variances, strict=True)):
                y = float(innovation / np.sqrt(variance))
                self.autocorrelation[k] += (last[k] * y, y * y) if abs(y) <= 5.0 else (0.0, 0.0)
                last[k] = y if abs(y) <= 5.0 else 0.0
                counts[k] += 1
            widened.append((rows, innovations, [f * v for f, v in zip(factor, variances, strict=False)]))
        self.autocorrelation *= (1 - counts / 2000.0)[:, None]
        return widened

    def _update_all(self, measurements: Sequence[tuple[list[Vector], list[float], list[float]]]) -> Vector:
        rows = np.array([row for rows, _, _ in measurements for row in rows])
        innovation = np.array([value for _, values, _ in measurements for value in values])
        variances = [value for _, _, values in measurements for value in values]
        return self._update(rows, innovation, np.diag(variances))

    # ---- the map -------------------------------------------------------------------------------------------

    def add_known(self, label: int, x_m: float, y_m: float) -> None:
        """A beacon whose place is given: no part of the state."""
        self.beacons.append(Beacon(label, "known", (x_m, y_m)))

    def add(self, sighting: Sighting, mount: Pose) -> None:
        """The augment step: a beacon is a function of the state and of its sighting's noise."""
        p = self.params
        is_sized = p["range_scale_sd"] > 0

        def placed(state, noise):  # type: ignore[no-untyped-def]
            mount_x, mount_y, yaw = mount
            offset_x, offset_y = _turned(state[THETA], mount_x, mount_y)
            direction = state[THETA] + yaw + sighting.bearing_rad + noise[0]
            sensor_x, sensor_y = state[X] + offset_x, state[Y] + offset_y
            if sighting.range_m is None:
                inverse = p["ray_inverse_distance_per_m"] + noise[1]
                return [*state, sensor_x, sensor_y, direction, inverse]
            scale = 1 + noise[2]
            range_m = (sighting.range_m + noise[1]) / scale
            place = [sensor_x + range_m * np.cos(direction), sensor_y + range_m * np.sin(direction)]
            return [*state, *place, scale] if is_sized else [*state, *place]

        bearing_var = p["bearing_sd_rad"] ** 2
        if sighting.range_m is None:
            noise = [bearing_var * p["bearing_only_variance_factor"], p["ray_inverse_distance_sd_per_m"] ** 2]
        else:
            noise = [bearing_var, self._range_variance(sighting.range_m), p["range_scale_sd"] ** 2]
        kind = "ray" if sighting.range_m is None else "sized" if is_sized else "point"
        beacon = Beacon(sighting.label, kind)
        self._change(placed, np.diag(noise), [*self.beacons, beacon])

    def _begin_scale(self, sighting: Sighting, mount: Pose) -> bool:
        """A point or a ray that is seen with a distance has a scale from then on, if things have any. True:
        its distance is used up.
        """
        index, scale_sd = self.find(sighting.label), self.params["range_scale_sd"]
        if index is None or sighting.range_m is None or not scale_sd > 0:
            return False
        kind, at = self.beacons[index].kind, self.at(index)
        if kind not in ("point", "ray"):
            return False

        def sized(state, noise):  # type: ignore[no-untyped-def]
            scale, behind = 1 + noise[0], at + self.beacons[index].size
            if kind == "point":
                return [*state[:behind], scale, *state[behind:]]
            offset_x, offset_y = _turned(state[THETA], mount[0], mount[1])
            to_x, to_y = state[at] - state[X] - offset_x, state[at + 1] - state[Y] - offset_y
            c, s = np.cos(state[at + 2]), np.sin(state[at + 2])
            # The length at which anchor + length (c, s) is as far from the sensor as was measured.
            range_m = (sighting.range_m + noise[1]) / scale
            half = to_x * c + to_y * s
            length = np.sqrt(half**2 - to_x**2 - to_y**2 + range_m**2) - half
            place = [state[at] + length * c, state[at + 1] + length * s]
            return [*state[:at], *place, scale, *state[behind:]]

        beacons = list(self.beacons)
        beacons[index] = Beacon(sighting.label, "sized")
        self._change(sized, np.diag([scale_sd**2, self._range_variance(sighting.range_m)]), beacons)
        return kind == "ray"

    def remove(self, index: int) -> None:
        """Takes a beacon out: what is left of the state does not depend on it."""
        at, size = self.at(index), self.beacons[index].size
        self.last.pop(self.beacons[index].label, None)
        others = [beacon for i, beacon in enumerate(self.beacons) if i != index]
        self._change(lambda state, noise: [*state[:at], *state[at + size :]], beacons=others)

    def _settle(self, index: int, mount: Pose) -> None:
        """A ray whose distance is known well enough becomes its point."""
        at = self.at(index)
        if self.beacons[index].kind != "ray" or not self._is_linear(at, mount):
            return

        def settled(state, noise):  # type: ignore[no-untyped-def]
            x = state[at] + np.cos(state[at + 2]) / state[at + 3]
            y = state[at + 1] + np.sin(state[at + 2]) / state[at + 3]
            return [*state[:at], x, y, *state[at + 4 :]]

        others = list(self.beacons)
        others[index] = Beacon(self.beacons[index].label, "point")
        self._change(settled, beacons=others)

    def _is_linear(self, at: int, mount: Pose) -> bool:
        """Civera's index: 4 sd(distance) |cos(parallax)| / distance from the sensor, against its limit."""
        anchor_x, anchor_y, direction, inverse = self.mean[at : at + 4]
        variance = self.own_covariance[at + 3, at + 3]
        if not (inverse > 1e-3 and variance > 0):
            return False
        mount_x, mount_y, _ = mount
        offset_x, offset_y = _turned(self.mean[THETA], mount_x, mount_y)
        dx = anchor_x + np.cos(direction) / inverse - (self.mean[X] + offset_x)
        dy = anchor_y + np.sin(direction) / inverse - (self.mean[Y] + offset_y)
        parallax = np.arctan2(dy, dx) - direction
        distance_sd = np.sqrt(variance) / inverse**2
        return bool(
            4 * distance_sd * abs(np.cos(parallax)) / np.hypot(dx, dy) < self.params["ray_linear_limit"]
        )
