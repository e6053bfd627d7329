"""Topics of recordings, by the libraries that read them.

PX4's flight logs, ``.ulg``, by pyulog. Bags of ROS 1 (``.bag``) and ROS 2 (a folder, ``.db3``), and
MCAP, by rosbags; the time of a message is its header's stamp, where it has one, else that of the
recorder.
"""

from __future__ import annotations

import dataclasses
import io
import os
import struct
from collections.abc import Collection, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import IntArray
from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.reading import opened, read_bytes

#: First bytes, length of the header, and types of messages.
_MAGIC, _HEADER, _TYPES = b"ULog\x01\x12\x35", 16, b"BFIMPQADRLCSO"
#: Whole messages that show where the log goes on behind damaged bytes.
_FOLLOWING = 8
#: Bytes of a message that is no sensor's (images, clouds), and numbers of an array.
_LARGE, _ARRAY = 1 << 14, 64


@dataclass(frozen=True, eq=False)
class Topic:
    """Messages of one name, as recorded.

    Attributes
    ----------
    name, kind : str
        Name, and type of the messages.
    stamps : int64 (n,)
        Times [ns].
    fields : mapping of str to array (n,)
        Numbers of each message, by the path to them: ``angular_velocity.x``, ``q[0]``.
    """

    name: str
    kind: str
    stamps: IntArray
    fields: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Recording:
    """Topics of a file, and remarks about it."""

    topics: tuple[Topic, ...]
    notes: tuple[str, ...] = ()


def _damage(path: Path, wanted: str, error: Exception, fix: str) -> InputError:
    """The error of a file whose library raised another one, of any kind."""
    found = " ".join(str(error).split())[:120] or type(error).__name__
    return InputError.at(str(path), wanted=wanted, found=f"damage: {found}", fix=fix)


def read_ulog(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a flight log; of several instances of one, all but the first have a number."""
    content = read_bytes(path, "a log file that can be read")
    read = optional("pyulog").ULog
    notes = []
    try:
        complete, lost, is_cut = _complete_messages(content)
        if is_cut:
            notes.append(f"{path.name} ends in the middle of a message, the rows before are read")
        with redirect_stdout(io.StringIO()):  # pyulog prints remarks
            log = read(io.BytesIO(complete), None if wanted is None else list(wanted))
        if lost or log.file_corruption:
            told = [f"{lost} bytes are left out"] * bool(lost)
            told += ["rows may be missing from the damage on"] * log.file_corruption
            notes.append(f"{path.name}: damaged, {', and '.join(told)}")
        topics: dict[str, Topic] = {}
        for data in log.data_list:
            name = f"{data.name}.{data.multi_id}" if data.name in topics else data.name
            stamps = data.data["timestamp"].astype(np.int64) * 1000
            topics[name] = Topic(name, data.name if name == data.name else name, stamps, data.data)
    except Exception as error:  # pyulog raises exceptions of any kind for damaged bytes
        raise _damage(path, "a flight log of PX4 (ULog)", error, "download it again") from None
    return Recording(tuple(topics.values()), tuple(notes))


def _complete_messages(content: bytes) -> tuple[bytes, int, bool]:
    """The whole messages, how many bytes between them are none, and whether the last one is cut.

    A log ends wherever the power failed, and a bad sector damages its middle. A message that is
    followed by no other is damaged, too: bytes of it were changed or lost.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("the first bytes are not those of a ULog")
    parts, offset, lost = [content[:_HEADER]], _HEADER, 0
    while offset + 3 <= len(content):
        end = _message_end(content, offset)
        if end is not None and end <= len(content):
            parts.append(content[offset:end])
            offset = end
            continue
        places = range(offset, len(content) - 2)
        following = next((k for k in places if _begins(content, k)), len(content))
        if end is not None and following == len(content):
            break  # cut, not damaged
        lost += following - offset + (len(parts.pop()) if len(parts) > 1 else 0)
        offset = following
    is_cut = offset < len(content) and (not lost or offset + 3 <= len(content))
    return b"".join(parts), lost, is_cut


def _message_end(content: bytes, offset: int) -> int | None:
    """Where the message that begins here ends; None if none does."""
    size, kind = struct.unpack_from("<HB", content, offset)
    return offset + 3 + size if kind in _TYPES else None


def _begins(content: bytes, offset: int) -> bool:
    """Whether several whole messages follow from here, up to the end."""
    for _ in range(_FOLLOWING):
        if offset + 3 > len(content):
            return offset == len(content)
        end = _message_end(content, offset)
        if end is None:
            return False
        offset = end
    return offset <= len(content)


def read_bag(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a bag, all or those of some names or types."""
    reader = optional("rosbags.highlevel").AnyReader
    types = optional("rosbags.typesys")
    if not os.path.isdir(path):
        with opened(path, "a log file that can be read"):
            pass
    series: dict[str, _Series] = {}
    fault: Exception | None = None
    try:
        store = types.get_typestore(types.Stores.LATEST)  # for bags that do not define their types
        with reader([path], default_typestore=store) as bag:
            chosen = [
                c for c in bag.connections if wanted is None or {c.topic, c.msgtype} & {*wanted}
            ]
            for c in chosen:
                series.setdefault(c.topic, _Series(str(c.topic), str(c.msgtype)))
            for c, stamp, raw in bag.messages(chosen) if chosen else ():
                large = len(raw) > _LARGE
                series[c.topic].take(stamp, None if large else bag.deserialize(raw, c.msgtype))
    except Exception as error:  # rosbags raises exceptions of any kind for damaged bytes
        fault = error
    if fault is not None and not any(s.stamps for s in series.values()):
        wanted = "a bag of ROS 1 or 2, or MCAP with messages of ROS"
        fix = "record it again, or repair it (rosbag reindex, mcap recover)"
        raise _damage(path, wanted, fault, fix) from None
    notes = () if fault is None else (f"{path.name}: damaged, only the messages before are read",)
    return Recording(tuple(s.topic() for s in series.values()), notes)


class _Series:
    """Messages of one topic."""

    def __init__(self, name: str, kind: str) -> None:
        self.name, self.kind = name, kind
        self.stamps: list[np.int64] = []
        self._leaves: list[tuple[str, int]] | None = None
        self._rows: list[tuple[Any, ...]] = []

    def take(self, stamp: int, message: Any) -> None:
        """Take a message; None of a large one, of which only the time counts."""
        time = np.int64(stamp)  # raises for a damaged stamp
        if message is not None:
            if self._leaves is None:
                self._leaves = [*_leaves(message)]
                # Of one path attrgetter gives no tuple.
                self._get = attrgetter(*(p for p, _ in self._leaves), "__class__", "__class__")
            self._rows.append(self._get(message))
        self.stamps.append(time)

    def topic(self) -> Topic:
        """Fields as arrays; those of changing size are left out."""
        stamps, fields = np.array(self.stamps, dtype=np.int64), dict[str, Any]()
        columns = [*zip(*self._rows, strict=True)] if len(self._rows) == len(stamps) else []
        for (path, size), column in zip(self._leaves or (), columns, strict=False):
            if size and all(len(x) == size for x in column):
                table = np.array(column)
                fields |= {f"{path}[{k}]": table[:, k] for k in range(size)}
            elif not size:
                fields[path] = np.array(column)
        sec, rest = fields.get("header.stamp.sec"), fields.get("header.stamp.nanosec")
        if sec is not None and rest is not None and (sec.any() or rest.any()):
            stamps = sec.astype(np.int64) * 1_000_000_000 + rest.astype(np.int64)
        return Topic(self.name, self.kind, stamps, fields)


def _leaves(message: Any, prefix: str = "") -> Iterator[tuple[str, int]]:
    """Paths to numbers and to short arrays of them, with their size; 0 of a number."""
    for field in dataclasses.fields(message):
        path, value = f"{prefix}{field.name}", getattr(message, field.name)
        if field.name.isupper():  # a constant of the message
            continue
        if dataclasses.is_dataclass(value):
            yield from _leaves(value, f"{path}.")
        elif isinstance(value, bool | int | float):
            yield path, 0
        elif isinstance(value, np.ndarray) and 0 < value.size <= _ARRAY:
            yield path, value.size
