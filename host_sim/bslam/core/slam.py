"""The estimator as a class."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.appearance import SIGNATURE_SIZE, encode
from bslam.core.builds import sightings_max
from bslam.core.inputs import INT32, checked_rows, frame_rows, number, refused_field, whole
from bslam.core.raw import Flash, library
from bslam.errors import BslamError, did_you_mean, setting_instead

BY_APPEARANCE = (3, 6, 7, 8)
"""Values of the setting `association` by which classifiers learn."""
_TICKS = (0, 2**32 - 1)
_NOT_MAPPABLE = 255  # BSLAM_CLASS_NOT_MAPPABLE
_BESIDE_SPEEDS = "contradicts velocity_states = 1: allowed beside it is"
_FINITE = {"BSLAM_E_NOT_FINITE": "finite numbers"}
_ODOMETRY_ALLOWED = {
    "BSLAM_E_TIME": "a stamp in microseconds above the one before, by up to 4 s (else resume_odometry first)",
    "BSLAM_E_RANGE": "counts below counter_modulus, and a gyro's turn up to 100 rad a reading",
    **_FINITE,
}
_WITHIN = "a stamp within the last readings of odometry"
_DOUBT = {"BSLAM_E_RANGE": "sd from 0 to 30 m and from 0 to 3.2 rad"}
# What is wrong with a parameter that is within its range.
_CONTRADICTIONS = {
    "scale_states": f"{_BESIDE_SPEEDS} 0",
    "left_speed_sd_mps": f"{_BESIDE_SPEEDS} a number above 0",
    "right_speed_sd_mps": f"{_BESIDE_SPEEDS} a number above 0",
    "range_sd_floor_m": "leaves distances without noise: allowed are range_sd_floor_m, range_sd_fraction and "
    "range_sd_per_m that make 1 mm or more at 1 m",
    "counter_modulus": "tells no direction: allowed are 0 and whole numbers from 3",
}


Column = Sequence[float] | NDArray[Any]
"""A number (or True, False) of each sighting: a list, or an array (n,) of any kind of number."""


@dataclass(frozen=True)
class Parameter:
    """One setting of the C library. group: "settings", "expert" or "tuning"."""

    name: str
    meaning: str
    group: str
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

    Position in m in the start pose's frame; covariance_m2 (2, 2) float64; polar from the start.
    """

    uid: int
    label: int
    kind: str
    confirmed: bool
    sightings: int
    x_m: float
    y_m: float
    covariance_m2: NDArray[np.float64]
    range_m: float
    phi_rad: float


class Slam:
    """A robot that localises itself and maps beacons: one bslam_t.

    params: settings by the names of bslam_settings_t, the rest at their defaults. beacons_max: beacons the
    map must hold. real: "float", as on the target, or "double". seeds (n, 71): signatures of things that are
    no beacon here. Raises BslamError for what is no setting or is out of range.
    """

    def __init__(
        self,
        params: Mapping[str, float] | None = None,
        *,
        beacons_max: int = 20,
        real: str = "float",
        seeds: NDArray[np.float32] | None = None,
    ) -> None:
        self._raw = library(str(real), whole(beacons_max, "beacons_max", INT32))
        self._lib, self._ffi = self._raw.lib, self._raw.ffi
        self._robot = self._ffi.new("bslam_t *")
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
        self._table = {parameter.name: parameter for parameter in self.parameters(real)}
        self._settings = self._ffi.new("bslam_settings_t *")
        self._lib.bslam_settings_preset(self._settings, self._lib.BSLAM_PRESET_REAL_WHEELS)
        self._set(params or {})
        if seeds is not None:
            self._seeds = self._samples(seeds)  # the C instance reads them where they are
            self._settings.seeds, self._settings.seed_count = self._seeds, len(seeds)
        self._begin(self._robot)

    def __repr__(self) -> str:
        x_m, y_m, theta_rad = self.pose()
        return (
            f"Slam at x {x_m:.3g} m, y {y_m:.3g} m, theta {theta_rad:.3g} rad, {len(self.beacons())} beacons"
        )

    def _set(self, params: Mapping[str, float]) -> None:
        if not isinstance(params, Mapping):
            raise BslamError(f"settings {params!r}: allowed is a mapping, names to numbers")
        for name, value in params.items():
            if name not in self._table:
                raise BslamError(f"parameter {name!r} does not exist; {setting_instead(name, self._table)}")
            parameter = self._table[name]
            kind = "a whole number" if parameter.is_integer else "a number"
            allowed = f"{kind} from {parameter.low:g} to {parameter.high:g}"
            value = number(value, f"parameter {name} =", allowed)
            if not parameter.low <= value <= parameter.high or (parameter.is_integer and value != int(value)):
                raise BslamError(f"parameter {name} = {value}: allowed is {allowed}")
            setattr(self._settings, name, int(value) if parameter.is_integer else value)

    def _samples(self, signatures: NDArray[np.float32]) -> Any:
        """Signatures (n, 71) as a C array."""
        encoded = encode(signatures, self._raw.real)
        array = self._ffi.new("bslam_sample_t[]", len(encoded))
        self._ffi.buffer(array)[:] = encoded.tobytes()
        return array

    def _begin(self, robot: Any) -> None:
        """bslam_init: at the origin of an empty map."""
        size, sizes = self._ffi.sizeof("bslam_t"), self._lib.BSLAM_SIZES_HASH
        bad = self._ffi.new("int *", -1)
        status = self._lib.bslam_init_sized(robot, size, sizes, self._settings, bad)
        if bad[0] >= 0:
            name = self._raw.text(self._lib.bslam_settings_info(bad[0]).name)
            value = getattr(self._settings, name)
            self._raw.ensure(status, f"parameter {name} = {value:g} {_CONTRADICTIONS[name]}")
        self._raw.ensure(status, f"{self._settings.seed_count} seeds")

    def restart(self, position_sd_m: float, heading_sd_rad: float) -> None:
        """After a reset: goes on with the memory as it is, or with its copy, so much more doubtful.

        Only with the setting `guard`. Raises CoreError if the memory holds no such state.
        """
        doubt = _doubt(position_sd_m, heading_sd_rad)
        status = self._lib.bslam_restart(self._robot, *doubt)
        self._raw.ensure(status, f"restart with sd {position_sd_m} m, {heading_sd_rad} rad", _DOUBT)

    @staticmethod
    def parameters(real: str = "float") -> list[Parameter]:
        """Every parameter with its meaning, default and range, in the order of the C table."""
        raw = library(real, 1)
        found = []
        for info in raw.settings_infos():
            # Float's 0.1 prints as 0.10000000149; seven digits round-trip float and read as written.
            initial, low, high = (float(f"{value:.7g}") for value in (info.initial, info.low, info.high))
            name, meaning, group = (raw.text(word) for word in (info.name, info.meaning, info.group))
            found.append(Parameter(name, meaning, group, initial, low, high, info.is_integer))
        return found

    @staticmethod
    def defaults() -> dict[str, float]:
        """Every parameter's default by name."""
        return {p.name: int(p.default) if p.is_integer else p.default for p in Slam.parameters()}

    @property
    def params(self) -> dict[str, float]:
        """The values in force."""
        return {name: getattr(self._settings, name) for name in self._table}

    @property
    def state_bytes(self) -> bytes:
        """Every byte of the C instance: a refused input changes none of them but counters."""
        return bytes(self._ffi.buffer(self._robot))

    @property
    def memory(self) -> memoryview:
        """The bytes of the C instance themselves, which may be damaged, to see what becomes of it."""
        return memoryview(self._ffi.buffer(self._robot)).cast("B")

    def fingerprint(self, before: int) -> int:
        """Goes on with a chain of fingerprints of the state (`bslam_fingerprint`)."""
        return int(self._lib.bslam_fingerprint(self._robot, before))

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
            near = did_you_mean(str(kind), self._sources)
            raise BslamError(f"odometry of kind {kind!r}: allowed are {', '.join(self._sources)}{near}")
        source, name_a, name_b = self._sources[kind]
        where = f"odometry at {time_us} us"
        reading = self._reading
        reading.time_us = whole(time_us, f"{where}: time_us")
        for name, value in ((name_a, a), (name_b, b)):
            what = f"{where}: {name}"
            setattr(reading, name, whole(value, what, _TICKS) if kind == "ticks" else number(value, what))
        reading.source = source
        reading.has_gyro = gyro_radps is not None
        reading.gyro_radps = 0.0 if gyro_radps is None else number(gyro_radps, f"{where}: gyro_radps")
        reading.gyro_sd_radps = number(gyro_sd_radps, f"{where}: gyro_sd_radps")
        status = self._lib.bslam_odometry(self._robot, reading)
        if status:
            gyro = "" if gyro_radps is None else f", gyro_radps {gyro_radps}"
            speed = f"a wheel's speed up to speed_max_mps = {self._settings.speed_max_mps:g} m/s"
            allowed = {**_ODOMETRY_ALLOWED, "BSLAM_E_JUMP": speed}
            self._raw.ensure(status, f"{where} ({name_a} {a}, {name_b} {b}{gyro})", allowed)

    def resume_odometry(self, position_sd_m: float, heading_sd_rad: float) -> None:
        """After an interruption: the next reading starts the clock, and the pose is this much more doubtful.

        Raises CoreError if a standard deviation is outside 0 to 30 m or 0 to 3.2 rad.
        """
        status = self._lib.bslam_resume_odometry(self._robot, *_doubt(position_sd_m, heading_sd_rad))
        self._raw.ensure(status, f"resume with sd {position_sd_m} m, {heading_sd_rad} rad", _DOUBT)

    def sightings(
        self,
        time_us: int,
        bearing_rad: Column,
        range_m: Column,
        label: Column,
        mappable: Column,
        bearing_sd_rad: Column | None = None,
        range_sd_m: Column | None = None,
        range_scale_sd: Column | None = None,
        signature: NDArray[np.float32] | None = None,
        beacon_class: Column | None = None,
        score: Column | None = None,
    ) -> list[Account]:
        """One image of n sightings: columns of n values each.

        time_us: when it was taken. bearing_rad: from the sensor's forward axis, left positive. range_m: NaN:
        direction only. label: whose it is; -1: no identity. mappable: False: a moving thing.

        The noise as the detector gives it, and by what part all distances of a thing err alike; 0, or none at
        all: as the parameters have it. signature (m, 71): how each looks; None: nobody knows.
        beacon_class: the detector's kind of each, 1 to 254; 0, or none at all: it does not say. score: how
        sure it is that each is a beacon; 0, or none at all: it does not say.

        Raises CoreError if refused, BslamError for what C cannot be told: the estimate is then unchanged.
        """
        where = f"frame at {time_us} us"
        at_us = whole(time_us, f"{where}: time_us")
        rows = frame_rows(
            where,
            bearing_rad=bearing_rad,
            range_m=range_m,
            label=label,
            mappable=mappable,
            bearing_sd_rad=bearing_sd_rad,
            range_sd_m=range_sd_m,
            range_scale_sd=range_scale_sd,
            beacon_class=beacon_class,
            score=score,
        )
        if signature is not None:
            signature = _checked_signatures(signature, len(rows))
        try:
            array = self._raw.sightings(rows, signature)
        except (OverflowError, TypeError, ValueError):
            array = self._raw.sightings(checked_rows(where, rows), signature)
        status = self._lib.bslam_sightings(self._robot, at_us, array, len(rows))
        if status:
            bad = self._lib.bslam_health(self._robot).bad_sighting
            which = f"sighting {bad}: {refused_field(rows[bad])}" if bad >= 0 else f"{len(rows)} sightings"
            most, ahead_us = sightings_max(self._raw.beacons_max), self._settings.ahead_max_us
            time = f"{_WITHIN}, at most ahead_max_us = {ahead_us} us after it, and no frame twice"
            allowed = {"BSLAM_E_COUNT": f"up to {most}", "BSLAM_E_TIME": time}
            self._raw.ensure(status, f"{where}, {which}", allowed)
        accounts = self._lib.bslam_results(self._robot, self._ffi.new("int *"))
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
        pose = self._lib.bslam_pose(self._robot)
        return pose.x_m, pose.y_m, pose.theta_rad

    def pose_at(self, time_us: int) -> tuple[float, float, float]:
        """The pose at a time within the history. Raises CoreError outside it."""
        status = self._lib.bslam_pose_at(self._robot, whole(time_us, "pose at time_us"), self._pose)
        if status:
            self._raw.ensure(status, f"pose at {time_us} us", {"BSLAM_E_TIME": _WITHIN})
        return self._pose.x_m, self._pose.y_m, self._pose.theta_rad

    def pose_covariance_lower(self) -> tuple[float, ...]:
        """xx, yx, yy, tx, ty, tt of the covariance of (x, y, theta) in m², m rad, rad²."""
        self._lib.bslam_pose_covariance(self._robot, self._lower)
        return tuple(self._lower)

    def pose_covariance(self) -> NDArray[np.float64]:
        """(3, 3) covariance of (x, y, theta) in m², m rad, rad²."""
        xx, yx, yy, tx, ty, tt = self.pose_covariance_lower()
        return np.array([[xx, yx, tx], [yx, yy, ty], [tx, ty, tt]])

    def beacons(self) -> list[Beacon]:
        """The map, tentative beacons included, in the order in which they were added."""
        view = self._ffi.new("bslam_beacon_view_t *")
        found = []
        for index in range(self._lib.bslam_health(self._robot).beacons):
            self._raw.ensure(self._lib.bslam_beacon(self._robot, index, view), f"beacon {index}")
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
                    covariance_m2=covariance,
                    range_m=view.range_m,
                    phi_rad=view.phi_rad,
                )
            )
        return found

    def add_known_beacon(self, label: int, x_m: float, y_m: float) -> None:
        """A beacon whose position is given and never changes. Raises CoreError."""
        place = (number(x_m, "known beacon: x_m"), number(y_m, "known beacon: y_m"))
        identity = whole(label, "known beacon: label", INT32)
        status = self._lib.bslam_add_known_beacon(self._robot, identity, *place)
        allowed = {"BSLAM_E_RANGE": "a label from 0, and a place within 10 km", **_FINITE}
        self._raw.ensure(status, f"known beacon {label} at ({x_m}, {y_m})", allowed)

    def set_pose(
        self, x_m: float, y_m: float, theta_rad: float, position_sd_m: float, heading_sd_rad: float
    ) -> None:
        """Puts the robot somewhere in the map, as of the last frame.

        Raises CoreError if it is not finite, or a standard deviation is outside 0 to 30 m or 0 to 3.2 rad.
        """
        values = zip(("x_m", "y_m", "theta_rad"), (x_m, y_m, theta_rad), strict=True)
        pose = self._ffi.new("bslam_pose_t *", tuple(number(one, f"pose: {name}") for name, one in values))
        status = self._lib.bslam_set_pose(self._robot, pose, *_doubt(position_sd_m, heading_sd_rad))
        doubt = f"sd {position_sd_m} m, {heading_sd_rad} rad"
        self._raw.ensure(status, f"pose ({x_m}, {y_m}, {theta_rad}) with {doubt}", _DOUBT | _FINITE)

    def save_map(self) -> bytes:
        """The confirmed beacons with covariance, and the classifiers, as docs/MAP.md has it."""
        data = bytearray()
        context = self._ffi.new_handle(data)
        sink = self._ffi.new("bslam_map_sink_t *", (self._lib.sink_write, context))
        size = self._ffi.new("uint32_t *")
        self._raw.ensure(self._lib.bslam_save_map(self._robot, sink, size), f"map of {size[0]} bytes")
        return bytes(data)

    def load_map(self, blob: bytes, *, frozen: bool = False) -> None:
        """Takes a map in place of its own; the robot does not know where it is in it (`set_pose`).

        frozen: nothing changes a beacon and none is added. Raises CoreError, and changes nothing, for a blob
        that is no whole map or that this build has no room for; the message says why.
        """
        was_frozen = self._lib.bslam_health(self._robot).is_frozen
        self._lib.bslam_freeze_map(self._robot, frozen)
        status, reason = self._load(self._robot, blob)
        if status:
            self._lib.bslam_freeze_map(self._robot, was_frozen)
            self._raw.ensure(status, f"map of {len(blob)} bytes: {reason}")

    def map_fault(self, blob: bytes) -> str:
        """What `load_map` would say of a blob: "fine", "bad crc", ..."""
        empty = self._ffi.new("bslam_t *")
        self._begin(empty)
        return self._load(empty, blob)[1]

    def _load(self, robot: Any, blob: bytes) -> tuple[int, str]:
        """Status and the name of the fault."""
        if not isinstance(blob, (bytes, bytearray, memoryview)):
            raise BslamError(f"map {blob!r}: allowed are bytes, as save_map gives them")
        context = self._ffi.new_handle(bytes(blob))
        source = self._ffi.new("bslam_map_source_t *", (self._lib.source_read, context, len(blob)))
        fault = self._ffi.new("bslam_map_fault_t *")
        status = self._lib.bslam_load_map(robot, source, fault)
        return status, self._raw.map_faults[fault[0]]

    def save_to_flash(self, flash: Flash) -> None:
        """Saves the map in the slot that is older or damaged. Raises CoreError with what failed."""
        self._ask_flash(self._lib.bslam_save_to_flash, flash)

    def load_from_flash(self, flash: Flash) -> None:
        """`load_map` of the newest one that is whole. Raises CoreError if there is none."""
        self._ask_flash(self._lib.bslam_load_from_flash, flash)

    def _ask_flash(self, call: Any, flash: Flash) -> None:
        context = self._ffi.new_handle(flash)
        functions = (self._lib.flash_erase, self._lib.flash_write, self._lib.flash_read)
        made = self._ffi.new("bslam_flash_t *", (*functions, context, flash.slot_bytes))
        fault = self._ffi.new("bslam_map_fault_t *")
        status = call(self._robot, made, fault)
        self._raw.ensure(status, f"flash: {self._raw.map_faults[fault[0]]}")

    def remove_beacon(self, uid: int) -> None:
        """Takes a beacon out of the map. Raises CoreError if there is none."""
        number_of_it = whole(uid, "beacon: uid", (0, 2**32 - 1))
        status = self._lib.bslam_remove_beacon(self._robot, number_of_it)
        self._raw.ensure(status, f"beacon {uid}", {"BSLAM_E_NO_BEACON": "a uid of beacons()"})

    def counters(self) -> dict[str, int]:
        """Never-decreasing counts by the names in bslam_counters_t; of what is switched off they are 0."""
        counters, counts = self._lib.bslam_counters(self._robot), dict[str, int]()
        for part in self._raw.fields(counters).values():
            counts |= self._raw.fields(part)
        return counts

    @property
    def is_lost(self) -> bool:
        """Nobody knows where the robot is: its pose is what odometry makes of an unknown one."""
        return bool(self._lib.bslam_health(self._robot).state == self._lib.BSLAM_RECOVERY_LOST)

    def lose_pose(self) -> None:
        """Says that nobody knows where the robot is; sightings are used for nothing until it is found."""
        status = self._lib.bslam_set_pose(self._robot, self._ffi.NULL, 0.0, 0.0)
        self._raw.ensure(status, "a pose that nobody knows")


def _doubt(position_sd_m: Any, heading_sd_rad: Any) -> tuple[float, float]:
    return number(position_sd_m, "position_sd_m"), number(heading_sd_rad, "heading_sd_rad")


def _checked_signatures(signature: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """As C reads it. Raises BslamError for another shape."""
    if np.shape(signature) != (count, SIGNATURE_SIZE):
        shape = np.shape(signature)
        raise BslamError(f"signatures of shape {shape}; allowed: ({count}, {SIGNATURE_SIZE}), or none")
    try:
        return np.ascontiguousarray(signature, np.float32)
    except (TypeError, ValueError) as error:
        raise BslamError(f"signatures: {error}; allowed: numbers") from error
