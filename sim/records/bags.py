"""Bags of ROS 1 (``.bag``) and ROS 2 (a folder, ``.db3``), and MCAP, by rosbags.

The time of a message is its header's stamp, where it has one, else that of the recorder.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Collection, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.reading import opened
from boresight.sim.records.topics import Recording, Topic

__all__ = ["is_bag", "read_bag"]

#: Bytes of a message that is no sensor's (images, clouds), and numbers of an array.
_LARGE, _ARRAY = 1 << 14, 64


def is_bag(path: Path) -> bool:
    """Whether a folder is a bag of ROS 2."""
    return os.path.isfile(path / "metadata.yaml")  # `Path.is_file` raises on some Pythons


def read_bag(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a bag.

    Parameters
    ----------
    wanted : collection of str, optional
        Names or types of topics; all by default.

    Raises
    ------
    InputError
        It is none, or damaged before the first message.
    ToolMissing
        rosbags is not installed.
    """
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
        message = " ".join(str(fault).split())[:120]
        raise InputError.at(
            str(path),
            wanted="a bag of ROS 1 or 2, or MCAP with messages of ROS",
            found=f"damage: {message or type(fault).__name__}",
            fix="record it again, or repair it (rosbag reindex, mcap recover)",
        ) from None
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
