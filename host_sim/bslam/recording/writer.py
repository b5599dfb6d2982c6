"""Entries into an MCAP file, as they happen."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

from mcap.writer import CompressionType, Writer

from bslam.errors import BslamError
from bslam.recording.entries import FORMATS, Entry, Json, Map, Start, State, TruePose
from bslam.recording.scene import POSE_SCHEMA, SCENE_SCHEMA, map_scene, pose_in_frame
from bslam.recording.schemas import SCHEMAS

_CHUNK_BYTES = 1 << 17
"""What a program that is killed loses at most."""


class RecordingWriter:
    """A recording in the making: `start` first, then `put`; `close`, or use it in a `with`.

    Raises BslamError if the file cannot be written.
    """

    def __init__(self, path: Path, start: Start) -> None:
        self.path = path
        self._log_ns = 0
        self._channels: dict[str, int] = {}
        self._sequence: dict[str, int] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
        except OSError as error:
            raise BslamError(f"{path}: cannot be written: {error}; allowed: a file one may write") from error
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(library=f"bslam {version('bslam')}")
        self.put(start)

    def put(self, entry: Entry) -> None:
        """The next entry; for viewers, what can be drawn of it too."""
        time_us = getattr(entry, "time_us", None)
        if time_us is not None:  # a late image comes when it comes: the order in the file is that of arrival
            self._log_ns = max(self._log_ns, time_us * 1000)
        form = FORMATS[type(entry)]
        self._add(form.topic, form.schema, form.write(entry))
        if isinstance(entry, State):
            self._add("/pose", POSE_SCHEMA, pose_in_frame(self._log_ns, entry.pose))
        elif isinstance(entry, TruePose):
            self._add("/true_pose", POSE_SCHEMA, pose_in_frame(self._log_ns, entry.pose))
        elif isinstance(entry, Map):
            self._add("/scene", SCENE_SCHEMA, map_scene(self._log_ns, entry.beacons))

    def _add(self, topic: str, schema: str, content: Json) -> None:
        if topic not in self._channels:
            data = json.dumps(SCHEMAS[schema]).encode()
            number = self._writer.register_schema(schema, "jsonschema", data)
            self._channels[topic] = self._writer.register_channel(topic, "json", number)
        self._sequence[topic] = self._sequence.get(topic, -1) + 1
        data = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        channel, sequence = self._channels[topic], self._sequence[topic]
        try:
            self._writer.add_message(channel, self._log_ns, data, self._log_ns, sequence)
        except OSError as error:
            raise BslamError(f"{self.path}: cannot be written: {error}") from error

    def close(self) -> None:
        """Write what is outstanding, and the index."""
        if self._file.closed:
            return
        try:
            self._writer.finish()
            self._file.close()
        except OSError as error:
            raise BslamError(f"{self.path}: cannot be written: {error}") from error

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
