"""What the user may choose for a run, and the one place where that becomes parameters of the core."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bslam.core.presets import PRESETS, preset_settings
from bslam.errors import BslamError, did_you_mean, setting_instead
from bslam.log import SIGHTING_DELAY_US, WHEEL_NOISES, WHEEL_SPEED_SIGMA_MPS, Log, Robot
from bslam.parsing.settings import SHARE, Rule, integer

OBSERVATIONS = ("distance", "direction")
ASSOCIATIONS = (
    "known",
    "nearest",
    "mahalanobis",
    "svm",
    "joint",
    "position",
    "nearest-sample",
    "centroid",
    "both",
)
BY_APPEARANCE = ("svm", "nearest-sample", "centroid", "both")
FILTERS = ("standard", "invariant", "smoother")
MOTIONS = ("euler", "arc")
ALIGNMENTS = ("none", "rigid", "similarity")
SENSORS = ("simulated", "camera")
REALS = ("float", "double")
# What shows a run that it is lost: nothing; several beacons that fit a pose elsewhere; or also, in a map that
# has settled, one that contradicts the pose.
RECOVERIES = ("off", "growing", "carried")

# A measurement without any noise would leave the filter to divide by what rounding leaves of the
# uncertainty: a noise-free sensor is told to err by this much. The core's own lowest for directions; over the
# few metres of a sighting, about as much in m.
LEAST_BEARING_SD_RAD = 1e-4
LEAST_RANGE_SD_M = 1e-3

Number = int | float


@dataclass(frozen=True)
class RunOptions:
    """One way of running the filter over a log. BslamError for a word or number that is not allowed."""

    observation: str = "distance"
    association: str = "known"
    wrong_identity_rate: float = 0.0  # "known:RATE": share of sightings whose identity is replaced by another
    filter: str = "invariant"
    motion: str = "arc"
    presets: tuple[str, ...] = ()  # of the C library; none: by what the log says, see `presets_of`
    velocity_states: bool | None = None  # None: as the presets have it
    noise: str | None = None  # what errs, reading or motion; None: as the log's robot says
    sensor: str = "simulated"
    rig: str | None = None  # the cameras, if the sensor is one
    target: str = "host"
    real: str = "float"  # scalar type of the core: as on the target, or the twin
    known_map: bool = False  # the log's true beacons are given to the filter, which only localises
    kept_map: str | None = None  # file of a map to start in, at a place that nobody knows
    frozen: bool = False  # that map stays as it is
    recovery: str | None = None  # one of RECOVERIES; None: the usual one, see `recovery_of`
    resume_sd: tuple[float, float] | None = None  # m, rad told after an interruption; None: by its length
    sigma_mps: float | None = None  # wheel-speed sigma told to the filter; None: what the log's robot says
    seed: int = 0  # seed of the harness's own randomness (wrong identities)
    odometry_lead_us: int | None = None  # odometry runs this far ahead of the truth; None: as the presets say
    align: str | None = None  # one of ALIGNMENTS, of the estimate to the truth; None: by the truth's frame
    map_align: str | None = None  # the same of the map, where `align` is not said; None: as the estimate
    parameters: tuple[tuple[str, Number], ...] = ()  # --params and --set: they win over all else

    def __post_init__(self) -> None:
        for name, allowed in _WORDS.items():
            value = getattr(self, name)
            if value is not None:
                ensure_word(name, value, allowed)
        for name, rule in _RULES.items():
            value = getattr(self, name)
            if value is not None:
                rule.convert(value, name)
        for preset in self.presets:
            ensure_word("preset", preset, PRESETS)
        if self.frozen and self.kept_map is None:
            raise BslamError("frozen: no map; allowed: with kept_map, the path of one")
        if self.kept_map is not None and (self.known_map or self.recovery == "off"):
            other = "known_map" if self.known_map else "recovery 'off'"
            raise BslamError(f"kept_map {self.kept_map!r} with {other}; allowed: one of them")

    @property
    def association_name(self) -> str:
        """As on the command line: "known", "known:0.05", "nearest", ..."""
        if self.association == "known" and self.wrong_identity_rate > 0.0:
            return f"known:{self.wrong_identity_rate:g}"
        return self.association


_WORDS = {
    "observation": OBSERVATIONS,
    "association": ASSOCIATIONS,
    "filter": FILTERS,
    "motion": MOTIONS,
    "noise": WHEEL_NOISES,
    "sensor": (*SENSORS, "recorded"),
    "real": REALS,
    "recovery": RECOVERIES,
    "align": ALIGNMENTS,
    "map_align": ALIGNMENTS,
}
"""Options that are words, and which ones."""
_RULES = {
    "wrong_identity_rate": SHARE,
    "sigma_mps": WHEEL_SPEED_SIGMA_MPS,
    "seed": integer(0),
    "presets": Rule("a tuple of names", tuple),
    **dict.fromkeys(("velocity_states", "known_map", "frozen"), Rule("True or False", bool)),
}


def ensure_word(what: str, word: object, allowed: Iterable[str]) -> None:
    """Raise BslamError, with the nearest one, for a word that is none of these."""
    names = tuple(allowed)
    if word not in names:
        near = did_you_mean(word, names) if isinstance(word, str) else ""
        raise BslamError(f"{what} {word!r} does not exist; allowed: {', '.join(names)}{near}")


def parse_association(text: str) -> tuple[str, float]:
    """ "known:0.05" -> ("known", 0.05). Raises BslamError for what is not allowed."""
    name, colon, rate_text = text.partition(":")
    allowed = f"allowed: known, known:RATE with RATE from 0 to 1, {', '.join(ASSOCIATIONS[1:])}"
    if name not in ASSOCIATIONS or (colon and name != "known"):
        raise BslamError(f"association '{text}' does not exist; {allowed}{did_you_mean(name, ASSOCIATIONS)}")
    if not colon:
        return name, 0.0
    try:
        rate = float(rate_text)
    except ValueError:
        rate = math.nan
    if not 0.0 <= rate <= 1.0:
        raise BslamError(f"association '{text}': '{rate_text}' is not a rate; {allowed}")
    return name, rate


def usual_filter(observation: str, has_map: bool = False) -> str:
    """What estimates, unless asked otherwise. has_map: there is one before the drive."""
    return "smoother" if observation == "direction" and not has_map else "invariant"


def wheel_noise(options: RunOptions, log: Log) -> str:
    """What errs, "speedometer" or "actuation": asked for, else what the log says."""
    return options.noise or log.robot.wheel_noise


def presets_of(options: RunOptions, log: Log) -> tuple[str, ...]:
    """The presets of the C library that a run starts from: asked for, else by what the log says of itself.

    "commanded" where speeds come without a noise: nobody measured them. "paper" where the reading of a wheel
    errs and not the wheel. It is wrong where the wheel itself jitters, and for real odometry. "camera" where
    a detector of images says how sure it is.
    """
    if options.presets:
        return options.presets
    kind = log.odometry.kind
    sigma_mps = log.robot.wheel_speed_sigma_mps if options.sigma_mps is None else options.sigma_mps
    is_paper = kind == "wheels" and wheel_noise(options, log) == "speedometer" and sigma_mps > 0.0
    chosen = ["paper" if is_paper else "real-wheels"]
    chosen += ["commanded"] if kind == "velocity" and sigma_mps == 0.0 else []
    is_camera = options.sensor == "camera" or log.sightings.score is not None
    chosen += ["camera"] if is_camera else []
    chosen += ["bearing-only"] if options.observation == "direction" else []
    return tuple(chosen)


def uses_velocity_states(options: RunOptions, log: Log) -> bool:
    """v and omega are states of the filter."""
    return bool(core_params(options, log)["velocity_states"])


def recovery_of(options: RunOptions) -> str:
    """One of RECOVERIES: asked for, else by what can go wrong.

    In a kept map the robot stands at a place that nobody knows. By appearance it may take one beacon
    for another; "carried" is for those who do carry it, and has false alarms where something new looks like
    a beacon.
    """
    if options.recovery is not None:
        return options.recovery
    if options.kept_map is not None:
        return "carried"
    return "growing" if options.association in BY_APPEARANCE else "off"


def odometry_lead_us(options: RunOptions, log: Log) -> int:
    """How far odometry runs ahead of the true motion: asked for, else what commands do."""
    if options.odometry_lead_us is not None:
        return options.odometry_lead_us
    return int(_preset_params(options, log)["sighting_delay_us"])


def core_params(options: RunOptions, log: Log) -> dict[str, Number]:
    """Every setting of the core by its name in C; a later source wins over an earlier one.

    Raises BslamError for a setting of robot.toml that does not exist, and for sightings that would wait for
    odometry: a robot's filter goes on without it, and a log's stamps can be right.
    """
    preset = _preset_params(options, log)
    params = preset | {"motion": MOTIONS.index(options.motion)}
    if options.velocity_states is not None:
        params["velocity_states"] = int(options.velocity_states)
        params["scale_states"] = (
            0 if options.velocity_states else preset["scale_states"]
        )  # they exclude each other
    params |= _robot_params(log.robot, log.odometry.kind)
    params["ahead_max_us"] = max(int(params["ahead_max_us"]), _odometry_interval_us(log))
    params["sighting_delay_us"] += preset["sighting_delay_us"]
    if "commanded" in presets_of(options, log):
        params |= {name: max(params[name], preset[name]) for name in _SIGHTING_NOISE}
    if options.sigma_mps is not None:
        params |= {"left_speed_sd_mps": options.sigma_mps, "right_speed_sd_mps": options.sigma_mps}
    for name, value in log.robot.settings:
        if name not in preset:
            allowed = setting_instead(name, preset)
            raise BslamError(f"{log.name}: robot.toml, [settings], key {name}: no such setting; {allowed}")
        params[name] = value
    params |= _recovery_params(recovery_of(options)) | dict(options.parameters)
    if params["sighting_delay_us"] < 0:
        early_us = -int(params["sighting_delay_us"])
        where = f"{log.name}: add {early_us} to time_us of sightings.csv instead; sighting_delay_us"
        SIGHTING_DELAY_US.convert(-early_us, where)
    return params


_SIGHTING_NOISE = ("bearing_sd_rad", "range_sd_floor_m", "range_sd_fraction")
"""What a preset that knows of errors alike for many frames counts at least, whatever their scatter is."""


def _odometry_interval_us(log: Log) -> int:
    """The usual one: no frame after the last reading is older than what odometry would have covered."""
    times_us = log.odometry.time_us
    return min(int(np.median(np.diff(times_us))), 10_000_000) if len(times_us) > 1 else 0


def _preset_params(options: RunOptions, log: Log) -> dict[str, Number]:
    association, filter_ = ASSOCIATIONS.index(options.association), FILTERS.index(options.filter)
    return preset_settings(presets_of(options, log), association, filter_)


def _recovery_params(recovery: str) -> dict[str, Number]:
    params: dict[str, Number] = {"recovery": int(recovery != "off")}
    if recovery == "growing":
        # Nothing settles: to be lost takes several beacons that fit a pose elsewhere.
        params["settled_us"] = 1_000_000_000
    return params


def _robot_params(robot: Robot, kind: str) -> dict[str, Number]:
    """What the log says of the robot and its sensor; noise where it says that there is none."""
    range_sd_per_m = 1.0 / robot.range_sigma_scale_m
    range_errs = robot.range_sigma_floor_m > 0.0 or robot.range_sigma_fraction > 0.0 or range_sd_per_m > 0.0
    params: dict[str, Number] = {
        "wheelbase_m": robot.wheelbase_m,
        "left_speed_sd_mps": robot.wheel_speed_sigma_mps,
        "right_speed_sd_mps": robot.wheel_speed_sigma_mps,
        "gyro_sd_radps": robot.gyro_sigma_radps,
        "mount_x_m": robot.sensor_x_m,
        "mount_y_m": robot.sensor_y_m,
        "mount_yaw_rad": robot.sensor_yaw_rad,
        "sighting_delay_us": robot.sighting_delay_us,
        "range_scale_sd": robot.sighting_scale_sd,
        "bearing_sd_rad": max(robot.bearing_sigma_rad, LEAST_BEARING_SD_RAD),
        "range_sd_floor_m": robot.range_sigma_floor_m if range_errs else LEAST_RANGE_SD_M,
        "range_sd_fraction": robot.range_sigma_fraction,
        "range_sd_per_m": range_sd_per_m,
    }
    if robot.sighting_correlation_m > 0.0:
        params["correlation_m"] = robot.sighting_correlation_m
    if kind == "ticks":
        assert robot.left_radius_m is not None and robot.right_radius_m is not None
        assert robot.ticks_per_revolution is not None and robot.counter_bits is not None
        params |= {
            "left_radius_m": robot.left_radius_m,
            "right_radius_m": robot.right_radius_m,
            "ticks_per_revolution": robot.ticks_per_revolution,
            "counter_bits": robot.counter_bits,
        }
    return params
