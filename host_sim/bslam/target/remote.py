"""The pipeline on a target, behind the interface of `bslam.core.Slam`."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bslam.core.builds import SIZE_CLASSES
from bslam.core.errors import CoreError
from bslam.core.inputs import frame_rows
from bslam.core.raw import library
from bslam.core.slam import BY_APPEARANCE, Account, Beacon, Slam
from bslam.errors import BslamError
from bslam.link import messages
from bslam.link.frames import Frame, crc16
from bslam.link.messages import NO_DETAIL, LookReport, Message, PoseReport, Report, Seen, Step
from bslam.target.client import Answer, Client
from bslam.target.lines import Line, TargetError, open_line

_LEFT_OUT = {
    "filter": "BSLAM_SMOOTHER",
    "association": "BSLAM_APPEARANCE",
    "recovery": "BSLAM_RECOVERY",
    "guard": "BSLAM_GUARD",
}
"""Parameters that ask for what an image may leave out, and by which switch."""
_MAP_ATTEMPTS = 3  # a robot that drives may change its map between two pieces of it


@dataclass(frozen=True)
class Told:
    """What a robot told of itself: a reading of its own encoders, or a picture of its own camera."""

    time_us: int
    report: PoseReport | LookReport
    refused: str | None  # the status by which the filter refused it
    seen: list[Seen] = field(default_factory=list)  # what the picture shows
    accounts: list[Account] = field(default_factory=list)


class RemoteSlam:
    """A robot at the other end of a line: the calls of `Slam`, the same results to the bit.

    params, beacons_max, seeds as for `Slam`; params None: the robot goes on as it is, with what it knows.
    `line` is taken over. Raises BslamError for parameters that the library refuses and for an image
    that is too small or has others, TargetError if the robot does not answer.
    """

    def __init__(
        self,
        line: Line,
        params: Mapping[str, float] | None,
        beacons_max: int,
        *,
        fingerprints: bool = False,
        seeds: NDArray[np.float32] | None = None,
    ) -> None:
        self._line = line
        self._raw = library("float", 1)
        as_it_is = params is None
        # What the image would refuse is refused here first, in the words of the library.
        self._values = Slam(params, beacons_max=beacons_max).params
        self._client = Client(line, fingerprints=fingerprints, as_it_is=as_it_is)
        self._check_image(beacons_max)
        self._step: Step | None = None
        self._sighted: list[Seen] = []  # of a picture whose report has not come yet
        self._instructions: list[int] = []
        self._outcomes = self._raw.enum_names("bslam_outcome_t", "BSLAM_OUTCOME_")
        self._reasons = self._raw.enum_names("bslam_reason_t", "BSLAM_REASON_")
        self._kinds = self._raw.enum_names("bslam_beacon_kind_t", "BSLAM_BEACON_")
        if not as_it_is and seeds is not None and self._values["association"] in BY_APPEARANCE:
            self._send_signatures(Message.SEEDS, seeds)
        if as_it_is:
            self._values = {name: self._param(number) for number, name in enumerate(self._values)}
        else:
            self._set_params()

    def _check_image(self, beacons_max: int) -> None:
        info = self._client.info
        names = [p.name for p in Slam.parameters()]
        crc = crc16(b"".join(name.encode() + b"\0" for name in names))
        if (info.params_count, info.params_crc) != (len(names), crc):
            raise BslamError(
                "the image has other parameters than this program: `make setup images` builds both anew"
            )
        if beacons_max > info.beacons_max:
            raise BslamError(
                f"the run needs room for {beacons_max} beacons, the image has {info.beacons_max}: "
                "build it with a larger BSLAM_BEACONS_MAX"
            )

    def _set_params(self) -> None:
        for number, (name, default) in enumerate(Slam.defaults().items()):
            value = self._values[name]
            if value == _as_float32(default):
                continue
            self._set_param(number, name, value)
        self.reset()

    def _set_param(self, number: int, name: str, value: float) -> None:
        self._ensure(self._client.ask(Message.PARAM_SET, messages.param_set(number, value)), name)
        kept = self._param(number)
        if kept != value:
            raise BslamError(f"parameter {name} = {value}: the link carries float32, which has {kept}")

    def _param(self, number: int) -> float:
        value = messages.read_value(self._client.ask(Message.PARAM_GET, messages.param_get(number)).body)
        return int(value) if isinstance(list(self._values.values())[number], int) else value

    # ---- the interface of Slam -----------------------------------------------------------------------------

    @staticmethod
    def defaults() -> dict[str, float]:
        """As `Slam.defaults`."""
        return Slam.defaults()

    @property
    def params(self) -> dict[str, float]:
        """The values in force."""
        return dict(self._values)

    @property
    def host_params(self) -> dict[str, float]:
        """Those with which a host's build, which remembers more, does what the target does."""
        steps = min(self._values["history_steps"], self._client.info.history_max)
        return self.params | {"history_steps": steps}

    def odometry(
        self,
        kind: str,
        time_us: int,
        a: float,
        b: float,
        gyro_radps: float | None = None,
        gyro_sd_radps: float = 0.0,
    ) -> None:
        """As `Slam.odometry`."""
        what = f"odometry at {time_us} us ({a}, {b})"
        payload = _packed(what, messages.odometry, kind, a, b, gyro_radps, gyro_sd_radps)
        self._take_step(self._client.ask(Message.ODOMETRY, payload, time_us), what)

    def resume_odometry(self, position_sd_m: float, heading_sd_rad: float) -> None:
        """As `Slam.resume_odometry`."""
        answer = self._client.ask(Message.RESUME, messages.resume(position_sd_m, heading_sd_rad))
        self._take_step(answer, f"resume with sd {position_sd_m} m, {heading_sd_rad} rad")

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
        """As `Slam.sightings`."""
        rows = frame_rows(
            f"frame at {time_us} us",
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
        signed, most = signature is not None, self._client.info.sightings_max
        payload = _packed(f"frame at {time_us} us", messages.sightings, rows, signed, most)
        if signature is not None:
            self._send_signatures(Message.SIGNATURES, signature[:most])
        answer = self._client.ask(Message.SIGHTINGS, payload, time_us)
        which = f"{len(rows)} sightings" if answer.detail == NO_DETAIL else f"sighting {answer.detail}"
        self._take_step(answer, f"frame at {time_us} us, {which}")
        return [self._account(one) for one in messages.read_accounts(answer.body)]

    def _send_signatures(self, message: Message, signature: NDArray[np.float32]) -> None:
        step = messages.signatures_a_frame(self._client.info.sightings_max)
        for first in range(0, len(signature), step):
            payload = messages.signatures(first, signature[first : first + step])
            self._ensure(self._client.ask(message, payload), message.name.lower())

    def _account(self, raw: messages.RawAccount) -> Account:
        return Account(
            self._outcomes[raw.outcome],
            self._reasons[raw.reason],
            raw.beacon_uid if raw.has_beacon else None,
            raw.test_ratio if raw.test_ratio >= 0 else None,
            raw.weight,
        )

    def pose(self) -> tuple[float, float, float]:
        """As `Slam.pose`: of the last step."""
        return self._last_step().pose

    def pose_covariance_lower(self) -> tuple[float, ...]:
        """As `Slam.pose_covariance_lower`."""
        return self._last_step().covariance

    def pose_at(self, time_us: int) -> tuple[float, float, float]:
        """As `Slam.pose_at`."""
        answer = self._client.ask(Message.POSE_AT, b"", time_us)
        status, pose = messages.read_pose_at(answer.body)
        if status:
            self._raw.ensure(status, f"pose at {time_us} us")
        return pose

    def beacons(self) -> list[Beacon]:
        """As `Slam.beacons`."""
        found: list[messages.RawBeacon] = []
        while True:
            answer = self._client.ask(Message.MAP, bytes((len(found),)))
            total, part = messages.read_beacons(answer.body)
            found += part
            if len(found) >= total:
                return [self._beacon(raw) for raw in found]
            if not part:
                raise TargetError(f"the map has {total} beacons, and the target sends {len(found)}")

    def _beacon(self, raw: messages.RawBeacon) -> Beacon:
        xx, xy, yy = raw.covariance
        return Beacon(
            uid=raw.uid,
            label=raw.label,
            kind=self._kinds[raw.kind],
            confirmed=raw.confirmed,
            sightings=raw.sightings,
            x_m=raw.x_m,
            y_m=raw.y_m,
            covariance_m2=np.array([[xx, xy], [xy, yy]]),
            range_m=raw.range_m,
            phi_rad=raw.phi_rad,
        )

    def set_pose(
        self, x_m: float, y_m: float, theta_rad: float, position_sd_m: float, heading_sd_rad: float
    ) -> None:
        """As `Slam.set_pose`."""
        payload = messages.set_pose(x_m, y_m, theta_rad, position_sd_m, heading_sd_rad)
        self._take_step(self._client.ask(Message.SET_POSE, payload), f"pose ({x_m}, {y_m}, {theta_rad})")

    def add_known_beacon(self, label: int, x_m: float, y_m: float) -> None:
        """As `Slam.add_known_beacon`."""
        payload = messages.known_beacon(label, x_m, y_m)
        self._ensure(
            self._client.ask(Message.KNOWN_BEACON, payload), f"known beacon {label} at ({x_m}, {y_m})"
        )

    def remove_beacon(self, uid: int) -> None:
        """As `Slam.remove_beacon`."""
        self._ensure(self._client.ask(Message.REMOVE_BEACON, messages.remove_beacon(uid)), f"beacon {uid}")

    def counters(self) -> dict[str, int]:
        """As `Slam.counters`."""
        values = iter(messages.read_counters(self._client.ask(Message.COUNTERS).body))
        found = {
            name: next(values) for part in ("slam", "appearance", "learner") for name in self._names(part)
        }
        health = self.health()
        return found | {
            name: getattr(health, name) for part in ("recovery", "guard") for name in self._names(part)
        }

    def _names(self, part: str) -> list[str]:
        """Of the counters of a part of the library."""
        return [name for name, _ in self._raw.ffi.typeof(f"bslam_{part}_counters_t").fields]

    @property
    def is_lost(self) -> bool:
        """As `Slam.is_lost`."""
        return self.health().state == "lost"

    def health(self) -> messages.Health:
        """What went wrong so far, and what the robot knows of it."""
        return messages.read_health(self._client.ask(Message.HEALTH).body)

    def save_map(self) -> bytes:
        """As `Slam.save_map`. Raises TargetError if the map changes while it is read, time and again."""
        for _ in range(_MAP_ATTEMPTS):
            blob = self._read_map()
            if self._raw_map_fault(blob) == "fine":
                return blob
        raise TargetError(f"the map changed while it was read, {_MAP_ATTEMPTS} times: let the robot stand")

    def _read_map(self) -> bytes:
        blob, size = b"", 1
        while len(blob) < size:
            answer = self._client.ask(Message.MAP_READ, messages.map_read(len(blob)))
            self._ensure(answer, f"map from byte {len(blob)}")
            size, part = messages.read_map_part(answer.body)
            blob += part
        return blob

    def _raw_map_fault(self, blob: bytes) -> str:
        return Slam(beacons_max=SIZE_CLASSES[-1]).map_fault(blob)

    def load_map(self, blob: bytes, *, frozen: bool = False) -> None:
        """As `Slam.load_map`. Raises TargetError for an image that takes no map, or none so large."""
        room = messages.map_bytes_a_frame(self._client.info.sightings_max)
        for at in range(0, len(blob), room):
            self._client.ask(Message.MAP_WRITE, messages.map_write(at, blob[at : at + room]))
        answer = self._client.ask(Message.MAP_LOAD, messages.map_load(len(blob), frozen))
        reason = self._raw.map_faults[answer.body[0]]
        self._ensure(answer, f"map of {len(blob)} bytes: {reason}")

    # ---- what only a target has ----------------------------------------------------------------------------

    def fingerprint(self, before: int) -> int:
        """Of all states so far (`bslam_fingerprint`), as the target has chained them."""
        return self._last_step().fingerprint

    @property
    def last_instructions(self) -> int | None:
        """Instructions that the target took for the last reading or frame, where its clock tells."""
        return self._instructions[-1] if self._instructions else None

    def target_description(self) -> dict[str, Any]:
        """What ran: image and its hash, the linker's build id, instructions in all where they can be had."""
        found = dict(self._line.description) | {"build_id": self._client.info.build_id}
        if self._line.ns_per_instruction is not None:
            found["instructions"] = sum(self._instructions)
        return found

    def close(self) -> None:
        """End the session and its line."""
        self._client.close()

    def __enter__(self) -> RemoteSlam:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def update(self) -> Step:
        """Ask where the robot stands now: it may move by itself."""
        self._step = messages.read_step(self._client.ask(Message.STATE).body)
        return self._step

    def reset(self) -> None:
        """Start over, with the parameters as set."""
        self._step = None
        answer = self._client.ask(Message.RESET)
        if answer.status:
            self._refuse(answer)
        self._client.drop_reports()
        self._sighted = []

    def _refuse(self, answer: Answer) -> None:
        """Raises TargetError for what the image leaves out: the host's build, which took it, has all."""
        name = list(self._values)[answer.detail]
        what = f"parameter {name} = {self._values[name]:g}"
        if name in _LEFT_OUT:
            raise TargetError(f"{what}: the image is built with {_LEFT_OUT[name]}=0")
        self._ensure(answer, what)

    def set_param(self, name: str, value: float) -> None:
        """Set a parameter for the next `reset`. Raises BslamError."""
        checked = Slam(self._values | {name: value}).params[name]
        self._set_param(list(self._values).index(name), name, checked)
        self._values[name] = checked

    def save_params(self) -> None:
        """Have the robot keep the parameters as set over a restart. Raises TargetError if it cannot."""
        self._client.ask(Message.PARAM_SAVE)

    def keep_map(self) -> None:
        """Have the robot keep its map as it is over a restart. Raises TargetError if it cannot."""
        self._client.ask(Message.MAP_SAVE)

    def reports(self, timeout_s: float | None) -> list[Told]:
        """What the robot told of itself since the last call, awaited so long (None: only what it had told
        before its last answer).
        """
        found: list[Told] = []
        for frame in self._client.listen(timeout_s):
            report = self._read_report(frame)
            if report is None:
                continue
            refused = self._refusal(report.status)
            if isinstance(report, LookReport):
                accounts = [self._account(one) for one in report.accounts]
                found.append(Told(frame.time_us, report, refused, self._sighted, accounts))
                self._sighted = []
            else:
                found.append(Told(frame.time_us, report, refused))
            self._step = report.step
        return found

    def _read_report(self, frame: Frame) -> PoseReport | LookReport | None:
        """None: a sighting, which is kept until the report of its picture. Raises TargetError."""
        try:
            if frame.type == Report.POSE:
                return messages.read_pose_report(frame.payload)
            if frame.type == Report.LOOKED:
                return messages.read_look_report(frame.payload)
            kept = self._sighted if frame.payload[0] else []  # a report may have been lost
            self._sighted = [*kept, messages.read_seen(frame.payload)]
        except (struct.error, IndexError):
            said = f"a report of type {frame.type} has {len(frame.payload)} bytes"
            raise TargetError(f"{said}: not as this program speaks") from None
        return None

    @property
    def reports_lost(self) -> int:
        """Reports that the line lost, by their sequence numbers."""
        return self._client.reports_lost

    def _refusal(self, status: int) -> str | None:
        try:
            self._raw.ensure(status, "")
        except CoreError as error:
            return error.status
        return None

    @property
    def info(self) -> messages.Info:
        """What the image says of itself."""
        return self._client.info

    def set_camera(self, index: int, record: messages.CameraRecord) -> None:
        """Set camera `index`, the last of index + 1; the front end starts over. Raises CoreError."""
        self._ensure(self._client.ask(Message.CAMERA, messages.camera(index, record)), f"camera {index}")

    def look(
        self, time_us: int, camera: int, picture: NDArray[np.uint16], moved: bool
    ) -> tuple[list[messages.Seen], list[Account]]:
        """Send a picture, (height, width) RGB565, for the robot's own front end; what it saw goes into the
        filter. Raises CoreError.
        """
        self._ensure(self._client.ask(Message.IMAGE, messages.image(camera, True)), f"image of {camera}")
        data = picture.astype("<u2").tobytes()
        piece = messages.payload_max(self._client.info.sightings_max)
        for at in range(0, len(data), piece):
            self._ensure(self._client.ask(Message.PIXELS, data[at : at + piece]), f"pixels {at}")
        answer = self._client.ask(Message.LOOK, bytes((int(moved),)), time_us)
        self._take_step(answer, f"image at {time_us} us")
        accounts, _, count = messages.read_look(answer.body)
        seen = [messages.read_seen(self._client.ask(Message.SEEN, bytes((i,))).body) for i in range(count)]
        return seen, [self._account(one) for one in accounts]

    # ---- inside --------------------------------------------------------------------------------------------

    def _take_step(self, answer: Answer, what: str) -> None:
        self._step = messages.read_step(answer.body)
        if self._line.ns_per_instruction is not None:
            ns = self._step.ticks * 1e9 / self._client.info.ticks_hz
            self._instructions.append(round(ns / self._line.ns_per_instruction))
        self._ensure(answer, what)

    def _last_step(self) -> Step:
        return self.update() if self._step is None else self._step

    def _ensure(self, answer: Answer, what: str) -> None:
        self._raw.ensure(answer.status, what)


def connect(
    target: str,
    params: Mapping[str, float] | None,
    beacons_max: int,
    *,
    fingerprints: bool = False,
    seeds: NDArray[np.float32] | None = None,
) -> RemoteSlam:
    """The pipeline on the target that a word of `--target` names; close it, or use it in a `with`."""
    line = open_line(target)
    try:
        return RemoteSlam(line, params, beacons_max, fingerprints=fingerprints, seeds=seeds)
    except BaseException:
        line.close()
        raise


def _as_float32(value: float) -> float:
    return value if isinstance(value, int) else float(np.float32(value))


def _packed(what: str, pack: Any, *values: Any) -> bytes:
    """A payload; raises BslamError for what the link cannot carry."""
    try:
        return bytes(pack(*values))
    except (struct.error, OverflowError, ValueError) as error:
        raise BslamError(f"{what}: {error}") from error
