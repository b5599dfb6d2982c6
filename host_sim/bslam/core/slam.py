"""The pipeline of the C library as a class."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.learner import SIGNATURE_SIZE, encode
from bslam.core.raw import library
from bslam.errors import BslamError

_NOT_MAPPABLE = 255  # BSLAM_CLASS_NOT_MAPPABLE; a macro has no place in an ffi declaration
# What velocity_states = 1 allows of other parameters: the only contradictions that there are.
_BESIDE_VELOCITY_STATES = {
    "scale_states": "0",
    "left_speed_sd_mps": "a number above 0",
    "right_speed_sd_mps": "a number above 0",
}


@dataclass(frozen=True)
class Parameter:
    """One run-time parameter of the C library."""

    name: str
    meaning: str
    default: float
    low: float
    high: float
    is_integer: bool


@dataclass(frozen=True)
class Account:
    """What became of a sighting: result "matched", "new", "rejected" or "deferred", and why."""

    result: str
    reason: str
    beacon_uid: int | None
    test_ratio: float | None
    weight: float


@dataclass(frozen=True)
class Beacon:
    """A beacon of the map.

    Position in m in the start pose's frame; covariance (2, 2) float64 in m²; polar from the start.
    """

    uid: int
    label: int
    kind: str
    confirmed: bool
    sightings: int
    x_m: float
    y_m: float
    covariance: NDArray[np.float64]
    range_m: float
    phi_rad: float


class Slam:
    """A robot that localises itself and maps beacons: one instance of the C pipeline.

    params: values by the C parameters' names, the rest at their defaults. beacons_max: beacons the map must
    hold. real: "float", as on the target, or "double", the twin. looks: it learns what the beacons look like
    (association 3); seeds (n, 71): signatures of things that are no beacon here. recovery: it notices when it
    is lost, and finds itself again. Raises BslamError for what is no parameter or is out of range.
    """

    def __init__(
        self,
        params: Mapping[str, float] | None = None,
        *,
        beacons_max: int = 20,
        real: str = "float",
        looks: bool = False,
        seeds: NDArray[np.float32] | None = None,
        recovery: bool = False,
    ) -> None:
        self._raw = library(real, beacons_max)
        self._lib, self._ffi = self._raw.lib, self._raw.ffi
        self._slam = self._ffi.new("bslam_slam_t *")
        self._reading = self._ffi.new("bslam_odometry_reading_t *")
        self._pose = self._ffi.new("bslam_pose_t *")
        self._lower = self._ffi.new("bslam_real_t[6]")
        self._outcomes = self._raw.enum_names("bslam_outcome_t", "BSLAM_OUTCOME_")
        self._reasons = self._raw.enum_names("bslam_reason_t", "BSLAM_REASON_")
        self._kinds = self._raw.enum_names("bslam_beacon_kind_t", "BSLAM_BEACON_")
        self._sources = {
            "wheels": (self._lib.BSLAM_ODOMETRY_WHEELS, "left_m", "right_m"),
            "ticks": (self._lib.BSLAM_ODOMETRY_TICKS, "left_ticks", "right_ticks"),
            "velocity": (self._lib.BSLAM_ODOMETRY_VELOCITY, "v_mps", "omega_radps"),
        }
        self._init(params or {})
        self._smoother = None
        if self._slam.params.filter == self._lib.BSLAM_FILTER_SMOOTHER:
            self._smoother = self._ffi.new("bslam_smoother_t *")
            self._lib.bslam_slam_attach_smoother(self._slam, self._smoother)
        self._recovery = None
        if recovery:
            self._recovery = self._ffi.new("bslam_recovery_t *")
            self._lib.bslam_recovery_init(self._recovery)
        self._looks = None
        if looks:
            self._attach_looks(np.empty((0, SIGNATURE_SIZE), np.float32) if seeds is None else seeds)

    def _attach_looks(self, seeds: NDArray[np.float32]) -> None:
        self._looks = self._ffi.new("bslam_appearance_t *")
        self._seeds = encode(self._raw, seeds)
        status = self._lib.bslam_appearance_init(self._looks, self._seeds, len(seeds))
        self._raw.ensure(status, f"{len(seeds)} seeds")
        self._lib.bslam_slam_attach_appearance(self._slam, self._looks)

    def _init(self, params: Mapping[str, float]) -> None:
        table = {p.name: p for p in self.parameters(self._raw.real)}
        c_params = self._ffi.new("bslam_settings_t *")
        self._lib.bslam_settings_default(c_params)
        for name, value in params.items():
            if name not in table:
                raise BslamError(f"parameter {name!r} does not exist; allowed are {', '.join(table)}")
            parameter = table[name]
            if not parameter.low <= value <= parameter.high or (parameter.is_integer and value != int(value)):
                kind = "a whole number" if parameter.is_integer else "a number"
                allowed = f"{kind} from {parameter.low:g} to {parameter.high:g}"
                raise BslamError(f"parameter {name} = {value}: allowed is {allowed}")
            setattr(c_params, name, int(value) if parameter.is_integer else value)
        bad_id = self._ffi.new("int *", -1)
        status = self._lib.bslam_slam_init(self._slam, c_params, bad_id)
        if status:
            name = self._raw.text(self._lib.bslam_settings_info(bad_id[0]).name)
            message = f"parameter {name} = {getattr(c_params, name):g} contradicts velocity_states = 1"
            self._raw.ensure(status, f"{message}: allowed beside it is {_BESIDE_VELOCITY_STATES[name]}")

    @staticmethod
    def parameters(real: str = "float") -> list[Parameter]:
        """Every parameter with its meaning, default and range, in the order of the C table."""
        raw = library(real, 1)
        found = []
        for index in range(raw.lib.bslam_settings_count()):
            info = raw.lib.bslam_settings_info(index)
            # Float's 0.1 prints as 0.10000000149; nine digits round-trip float and read as written.
            initial, low, high = (float(f"{value:.7g}") for value in (info.initial, info.low, info.high))
            found.append(
                Parameter(raw.text(info.name), raw.text(info.meaning), initial, low, high, info.is_integer)
            )
        return found

    @staticmethod
    def defaults() -> dict[str, float]:
        """Every parameter's default by name."""
        return {p.name: int(p.default) if p.is_integer else p.default for p in Slam.parameters()}

    @property
    def params(self) -> dict[str, float]:
        """The values in force."""
        return self._raw.fields(self._slam.params, "bslam_settings_t")

    @property
    def state_bytes(self) -> bytes:
        """Every byte of the C instance, its looks and smoother: a refused input changes none of them."""
        looks = b"" if self._looks is None else bytes(self._ffi.buffer(self._looks))
        smoother = b"" if self._smoother is None else bytes(self._ffi.buffer(self._smoother))
        return bytes(self._ffi.buffer(self._slam)) + looks + smoother

    def fingerprint(self, before: int) -> int:
        """Goes on with a chain of fingerprints of the state (`bslam_slam_fingerprint`)."""
        return int(self._lib.bslam_slam_fingerprint(self._slam, before))

    def odometry(
        self,
        kind: str,
        time_us: int,
        a: float,
        b: float,
        gyro_radps: float | None = None,
        gyro_sd_radps: float = 0.0,
    ) -> None:
        """One reading of kind "wheels" (a, b = left_m, right_m), "ticks" (counters), "velocity" (m/s, rad/s).

        gyro_radps: the mean turn rate since the reading before, if a gyro tells one; gyro_sd_radps: its own
        noise, 0: as the parameter of that name says.

        Raises CoreError if refused, BslamError for what C cannot be told: the estimate is then unchanged.
        """
        if kind not in self._sources:
            raise BslamError(f"odometry of kind {kind!r}: allowed are {', '.join(self._sources)}")
        source, name_a, name_b = self._sources[kind]
        reading = self._reading
        reading.source = source
        try:
            reading.time_us = time_us
            setattr(reading, name_a, a)
            setattr(reading, name_b, b)
        except OverflowError as error:
            raise BslamError(f"odometry at {time_us} us ({name_a} {a}, {name_b} {b}): {error}") from error
        reading.has_gyro = gyro_radps is not None
        reading.gyro_radps = gyro_radps or 0.0
        reading.gyro_sd_radps = gyro_sd_radps
        status = self._lib.bslam_slam_odometry(self._slam, reading)
        if status:
            self._raw.ensure(status, f"odometry at {time_us} us ({name_a} {a}, {name_b} {b})")

    def resume_odometry(self, position_sd_m: float, heading_sd_rad: float) -> None:
        """After an interruption: the next reading starts the clock, and the pose is this much more doubtful.

        Raises CoreError if a standard deviation is outside 0 to 30 m or 0 to 3.2 rad.
        """
        status = self._lib.bslam_slam_resume_odometry(self._slam, position_sd_m, heading_sd_rad)
        self._raw.ensure(status, f"resume with sd {position_sd_m} m, {heading_sd_rad} rad")

    def sightings(
        self,
        time_us: int,
        bearing_rad: Sequence[float],
        range_m: Sequence[float],
        label: Sequence[int],
        mappable: Sequence[bool],
        bearing_sd_rad: Sequence[float] | None = None,
        range_sd_m: Sequence[float] | None = None,
        range_scale_sd: Sequence[float] | None = None,
        signature: NDArray[np.float32] | None = None,
        beacon_class: Sequence[int] | None = None,
        score: Sequence[float] | None = None,
    ) -> list[Account]:
        """One image: equal lengths; range NaN: direction only; label -1: no identity.

        The noise as the detector gives it, and by what part all distances of a thing err alike; 0, or none at
        all: as the parameters have it. signature (m, 71): how each looks; None: nobody knows.
        beacon_class: the detector's kind of each, 1 to 254; 0, or none at all: it does not say. score: how
        sure it is that each is a beacon; 0, or none at all: it does not say.

        Raises CoreError if refused, BslamError for what C cannot be told: the estimate is then unchanged.
        """
        silent = [0.0] * len(bearing_rad)
        noise = (bearing_sd_rad or silent, range_sd_m or silent, range_scale_sd or silent)
        classes = told_classes(mappable, beacon_class)
        rows = list(zip(bearing_rad, range_m, label, classes, *noise, score or silent, strict=True))
        if signature is not None:
            signature = _checked_signatures(signature, len(rows))
        try:
            array = self._raw.sightings(rows, signature)
            if self._recovery is None:
                status = self._lib.bslam_slam_sightings(self._slam, time_us, array, len(rows))
            else:
                status = self._lib.bslam_recovery_sightings(
                    self._recovery, self._slam, time_us, array, len(rows)
                )
        except OverflowError as error:
            raise BslamError(f"frame at {time_us} us: {error}") from error
        if status:
            bad = self._lib.bslam_slam_bad_sighting(self._slam)
            which = f", sighting {bad} {rows[bad]}" if bad >= 0 else f", {len(rows)} sightings"
            self._raw.ensure(status, f"frame at {time_us} us{which}")
        accounts = self._slam.accounts
        return [self._account(accounts[i]) for i in range(len(rows))]

    def _account(self, account) -> Account:  # type: ignore[no-untyped-def]
        return Account(
            self._outcomes[account.outcome],
            self._reasons[account.reason],
            account.beacon_uid if account.has_beacon else None,
            account.test_ratio if account.test_ratio >= 0 else None,
            account.weight,
        )

    def pose(self) -> tuple[float, float, float]:
        """(x_m, y_m, theta_rad) in the start pose's frame."""
        pose = self._lib.bslam_slam_pose(self._slam)
        return pose.x_m, pose.y_m, pose.theta_rad

    def pose_at(self, time_us: int) -> tuple[float, float, float]:
        """The pose at a time within the history. Raises CoreError outside it."""
        status = self._lib.bslam_slam_pose_at(self._slam, time_us, self._pose)
        if status:
            self._raw.ensure(status, f"pose at {time_us} us")
        return self._pose.x_m, self._pose.y_m, self._pose.theta_rad

    def pose_covariance_lower(self) -> tuple[float, ...]:
        """xx, yx, yy, tx, ty, tt of the covariance of (x, y, theta) in m², m rad, rad²."""
        self._lib.bslam_slam_pose_covariance(self._slam, self._lower)
        return tuple(self._lower)

    def pose_covariance(self) -> NDArray[np.float64]:
        """(3, 3) covariance of (x, y, theta) in m², m rad, rad²."""
        xx, yx, yy, tx, ty, tt = self.pose_covariance_lower()
        return np.array([[xx, yx, tx], [yx, yy, ty], [tx, ty, tt]])

    def beacons(self) -> list[Beacon]:
        """The map, provisional beacons included, in the order in which they were added."""
        view = self._ffi.new("bslam_beacon_view_t *")
        found = []
        for index in range(self._lib.bslam_slam_beacon_count(self._slam)):
            self._raw.ensure(self._lib.bslam_slam_beacon(self._slam, index, view), f"beacon {index}")
            p = view.covariance_m2
            covariance = np.array([[p.xx, p.xy], [p.xy, p.yy]])
            found.append(
                Beacon(
                    uid=view.uid,
                    label=view.label,
                    kind=self._kinds[view.kind],
                    confirmed=view.confirmed,
                    sightings=view.sightings,
                    x_m=view.x_m,
                    y_m=view.y_m,
                    covariance=covariance,
                    range_m=view.range_m,
                    phi_rad=view.phi_rad,
                )
            )
        return found

    def add_known_beacon(self, label: int, x_m: float, y_m: float) -> None:
        """A beacon whose position is given and never changes. Raises CoreError."""
        status = self._lib.bslam_slam_add_known_beacon(self._slam, label, x_m, y_m)
        self._raw.ensure(status, f"known beacon {label} at ({x_m}, {y_m})")

    def set_pose(
        self, x_m: float, y_m: float, theta_rad: float, position_sd_m: float, heading_sd_rad: float
    ) -> None:
        """Puts the robot somewhere in the map, as of the last frame.

        Raises CoreError if it is not finite, or a standard deviation is outside 0 to 30 m or 0 to 3.2 rad.
        """
        pose = self._ffi.new("bslam_pose_t *", (x_m, y_m, theta_rad))
        status = self._lib.bslam_slam_set_pose(self._slam, pose, position_sd_m, heading_sd_rad)
        doubt = f"sd {position_sd_m} m, {heading_sd_rad} rad"
        self._raw.ensure(status, f"pose ({x_m}, {y_m}, {theta_rad}) with {doubt}")

    def save_map(self) -> bytes:
        """The confirmed beacons with covariance, and the machines, as docs/MAP.md has it."""
        size = self._lib.bslam_map_size(self._slam)
        room = self._ffi.new("uint8_t[]", size)
        memory = self._ffi.new("bslam_map_memory_t *", (room, size, 0))
        sink = self._ffi.new("bslam_map_sink_t *", self._lib.bslam_map_to_memory(memory))
        fault = self._ffi.new("bslam_map_fault_t *")
        self._raw.ensure(self._lib.bslam_map_write(self._slam, sink, fault), f"map of {size} bytes")
        return bytes(self._ffi.buffer(room, memory.count))

    def load_map(self, blob: bytes, *, frozen: bool = False) -> None:
        """Takes a map in place of its own; the robot does not know where it is in it (`set_pose`).

        frozen: nothing changes a beacon and none is added. Raises CoreError, and changes nothing, for a blob
        that is no whole map or that this build has no room for; the message says why.
        """
        source = self._source(blob)
        mode = self._lib.BSLAM_MAP_FROZEN if frozen else self._lib.BSLAM_MAP_LIVING
        fault = self._ffi.new("bslam_map_fault_t *")
        status = self._lib.bslam_map_load(self._slam, source[0], mode, fault)
        reason = self._raw.text(self._lib.bslam_map_fault_name(fault[0]))
        self._raw.ensure(status, f"map of {len(blob)} bytes: {reason}")

    def map_fault(self, blob: bytes) -> str:
        """What `load_map` would say of a blob, by pairs of its covariance: "fine", "bad crc", ..."""
        source = self._source(blob)
        return self._raw.text(self._lib.bslam_map_fault_name(self._lib.bslam_map_check(source[0])))

    def _source(self, blob: bytes) -> tuple[Any, Any]:
        """A source, and what must live as long as it is used."""
        held = self._ffi.from_buffer("uint8_t[]", blob)
        return self._ffi.new("bslam_map_source_t *", self._lib.bslam_map_from_memory(held, len(blob))), held

    def remove_beacon(self, uid: int) -> None:
        """Takes a beacon out of the map. Raises CoreError if there is none."""
        self._raw.ensure(self._lib.bslam_slam_remove_beacon(self._slam, uid), f"beacon {uid}")

    def counters(self) -> dict[str, int]:
        """Never-decreasing counts by the names of bslam_counters_t; with looks, theirs and the learner's."""
        counts = self._raw.fields(self._slam.counters, "bslam_counters_t")
        if self._looks is not None:
            counts |= self._raw.fields(self._looks.counters, "bslam_appearance_counters_t")
            counts |= self._raw.fields(self._looks.learner.counters, "bslam_learner_counters_t")
        if self._recovery is not None:
            counts |= self._raw.fields(self._recovery.counters, "bslam_recovery_counters_t")
        return counts

    @property
    def is_lost(self) -> bool:
        """Nobody knows where the robot is: its pose is what odometry makes of an unknown one."""
        return bool(self._slam.is_lost)

    def lose_pose(self) -> None:
        """Says that nobody knows where the robot is; sightings are used for nothing until it is found."""
        self._lib.bslam_slam_lose_pose(self._slam)


def told_classes(mappable: Sequence[bool], beacon_class: Sequence[int] | None) -> list[int]:
    """As C has them: 0 where none is told, 255 for what is not to be mapped."""
    told = beacon_class or [0] * len(mappable)
    return [one if is_mappable else _NOT_MAPPABLE for one, is_mappable in zip(told, mappable, strict=True)]


def _checked_signatures(signature: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """As C reads it. Raises BslamError for another shape."""
    if np.shape(signature) != (count, SIGNATURE_SIZE):
        shape = np.shape(signature)
        raise BslamError(f"signatures of shape {shape}; allowed: ({count}, {SIGNATURE_SIZE}), or none")
    return np.ascontiguousarray(signature, np.float32)
