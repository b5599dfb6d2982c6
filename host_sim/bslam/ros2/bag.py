"""Bags of ROS 2, mcap or sqlite3, read through the package rosbags (pure Python: no ROS is needed)."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final

from tqdm import tqdm

from bslam.errors import BslamError, pip_install
from bslam.ros2.definitions import DEFINITIONS

TF_STATIC: Final = "/tf_static"
INSTALL: Final = pip_install("rosbags")
_IDL_SEPARATOR: Final = "=" * 80 + "\n"
_TOPICS_MAX: Final = 30
"""So many are named in an error."""


class Bag:
    """A bag that is open for reading; a context manager.

    Raises BslamError where it cannot be read: no such file, damaged, or of a kind that is not known.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            from rosbags.rosbag2 import Reader
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError as error:
            raise BslamError(f"a bag needs the package rosbags, which is missing: {INSTALL}") from error
        _require_bag(path)
        with _Guard(path):
            self._reader = Reader(path)
            self._reader.open()
        self._types = dict(get_typestore(Stores.ROS2_HUMBLE).fielddefs)
        for name, text in DEFINITIONS.items():
            self._types |= get_types_from_msg(text, name)
        self._store: Any = None
        self.topics: dict[str, str] = {one.topic: one.msgtype for one in self._reader.connections}
        self.counts: dict[str, int] = dict.fromkeys(self.topics, 0)
        for one in self._reader.connections:
            self.counts[one.topic] += one.msgcount
        if not any(self.counts.values()):
            self._reader.close()
            raise BslamError(f"{path}: holds no messages at all; allowed: a bag with some")

    @property
    def start_ns(self) -> int:
        """When the first message was received."""
        return int(self._reader.start_time)

    @property
    def duration_s(self) -> float:
        return float(self._reader.duration * 1e-9)

    def __enter__(self) -> Bag:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._reader.close()

    def topic_of(self, option: str, topic: str | None, kinds: Sequence[str]) -> tuple[str, str] | None:
        """The topic that an option names, else the only one of these kinds, and its kind; None: none.

        Raises BslamError if there is no such topic, it is of another kind, or there are several.
        """
        fit = self.fitting(kinds)
        if topic is None:
            if len(fit) > 1:
                raise BslamError(
                    f"{self.path}: several topics fit {option}; allowed: one of {self._listed(fit)}"
                )
            return (fit[0], self.topics[fit[0]]) if fit else None
        if topic not in self.topics:
            near = difflib.get_close_matches(topic, fit, 1, 0.4)
            hint = f", did you mean {near[0]}?" if near else ""
            raise BslamError(f"{self.path}: no topic {topic} ({option}){hint}; allowed: {self.offer(kinds)}")
        if self.topics[topic] not in kinds:
            said = f"{self.path}: topic {topic} ({option}) is of type {self.topics[topic]}"
            raise BslamError(f"{said}; allowed: {self.offer(kinds)}; types: {', '.join(kinds)}")
        return topic, self.topics[topic]

    def fitting(self, kinds: Sequence[str]) -> list[str]:
        """The topics of these kinds; nothing that is asked for moves in /tf_static."""
        return [name for name, kind in self.topics.items() if kind in kinds and name != TF_STATIC]

    def offer(self, kinds: Sequence[str]) -> str:
        """The topics of these kinds; if there are none, what there is."""
        fit = self.fitting(kinds)
        there = self._listed(list(self.topics))
        return f"one of {self._listed(fit)}" if fit else f"another bag (in this one: {there})"

    def _listed(self, names: Sequence[str]) -> str:
        rest = [f"and {len(names) - _TOPICS_MAX} more"] if len(names) > _TOPICS_MAX else []
        return ", ".join([f"{name} ({self.topics[name]})" for name in names[:_TOPICS_MAX]] + rest)

    def messages(self, topics: Sequence[str]) -> Iterator[tuple[str, int, Any]]:
        """Topic, time of receipt in ns, and message, in order; a bar on a terminal says how far it is."""
        chosen = [one for one in self._reader.connections if one.topic in topics]
        store, total = self._typestore(chosen), sum(one.msgcount for one in chosen)
        if not chosen or total == 0:
            return
        with _Guard(self.path), tqdm(total=total, desc="messages", unit="msg", disable=None) as bar:
            for connection, received_ns, data in self._reader.messages(chosen):
                message = store.deserialize_cdr(data, connection.msgtype)
                bar.update()
                yield connection.topic, received_ns, message

    def _typestore(self, connections: Sequence[Any]) -> Any:
        """Types for these topics: as the bag defines them, else as they are known here."""
        from rosbags.typesys import Stores, get_typestore

        types = dict(self._types)
        for one in connections:
            with _Guard(self.path):
                types |= _defined_in(one)
            if one.msgtype not in types:
                raise BslamError(
                    f"{self.path}: topic {one.topic} is of type {one.msgtype}, which the bag does not define;"
                    f" allowed: a bag in mcap, or the types {', '.join(DEFINITIONS)}"
                )
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        return store


def name_of(path: Path) -> str:
    """The name of a bag: a folder's may hold points, as run_1.2 does."""
    whole = path.resolve()
    return whole.name if whole.is_dir() else whole.stem


def _require_bag(path: Path) -> None:
    allowed = "allowed: a rosbag2 folder (with metadata.yaml), FILE.mcap or FILE.db3"
    if path.suffix == ".bag":
        made = f"rosbags-convert --src {path} --dst {path.with_suffix('')}"
        raise BslamError(f"{path}: a bag of ROS 1; allowed: one of ROS 2, which `{made}` makes of it")
    if not path.exists():
        raise BslamError(f"{path}: no such bag; {allowed}")
    if path.is_dir() and not (path / "metadata.yaml").exists():
        there = [one for one in sorted(path.iterdir()) if one.suffix in (".mcap", ".db3")]
        alone = f", as {there[0]}, which is in it" if there else ""
        raise BslamError(f"{path}: no metadata.yaml in it; {allowed}{alone}")
    if not path.is_dir() and path.suffix not in (".mcap", ".db3"):
        raise BslamError(f"{path}: no bag; {allowed}")


def _defined_in(connection: Any) -> dict[str, Any]:
    """The types that the bag defines for a topic, as .msg or as IDL."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    form, text = connection.msgdef.format, connection.msgdef.data
    if form == MessageDefinitionFormat.NONE:
        return {}
    if form == MessageDefinitionFormat.MSG:
        return dict(get_types_from_msg(text, connection.msgtype))
    parts = text.split(_IDL_SEPARATOR)[1:] if text.startswith(_IDL_SEPARATOR) else [f"\n{text}"]
    types: dict[str, Any] = {}
    for part in parts:
        types |= get_types_from_idl(part.split("\n", 1)[1])
    return types


class _Guard:
    """Whatever rosbags says of damage, as one line.

    It reads bytes as they come and so may raise anything; only what a user did, or we ourselves, goes by.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> None:
        logging.getLogger("rosbags").setLevel(logging.CRITICAL)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if not isinstance(error, Exception) or isinstance(error, BslamError):
            return
        said = " ".join(str(error).split()).removesuffix(".") or type(error).__name__
        if said.startswith("Profile"):
            raise BslamError(
                f"{self._path}: an mcap of another program; allowed: one of `ros2 bag`; of a recording "
                "of bslam, `bslam export FILE --format csv` makes a log folder"
            ) from error
        mend = "a recorder that was killed leaves such files: `mcap recover` or `ros2 bag reindex` mend them"
        raise BslamError(f"{self._path}: damaged, or no bag of ROS 2: {said}; {mend}") from error
