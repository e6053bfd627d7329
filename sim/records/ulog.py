"""PX4's flight logs, ``.ulg``, by pyulog."""

from __future__ import annotations

import io
import struct
from collections.abc import Collection
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path

import numpy as np

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.topics import Recording, Topic

__all__ = ["read_ulog"]

#: First bytes, length of the header, and types of messages.
_MAGIC, _HEADER, _TYPES = b"ULog\x01\x12\x35", 16, b"BFIMPQADRLCSO"


def read_ulog(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a flight log; of several instances of one, all but the first have a number.

    Parameters
    ----------
    wanted : collection of str, optional
        Names of topics; all by default.

    Raises
    ------
    InputError
        The content is none, or damaged.
    ToolMissing
        pyulog is not installed.
    """
    content = read_bytes(path, "a log file that can be read")
    try:
        read = import_module("pyulog").ULog
    except ImportError:
        raise ToolMissing(
            "pyulog was not found: pip install 'boresight[ulog]' for PX4's logs."
        ) from None
    try:
        complete = _complete_messages(content)
        with redirect_stdout(io.StringIO()):  # pyulog prints remarks
            sets = read(io.BytesIO(complete), None if wanted is None else list(wanted)).data_list
        topics: dict[str, Topic] = {}
        for data in sets:
            name = f"{data.name}.{data.multi_id}" if data.name in topics else data.name
            stamps = data.data["timestamp"].astype(np.int64) * 1000
            topics[name] = Topic(name, data.name if name == data.name else name, stamps, data.data)
    except Exception as error:  # pyulog raises exceptions of any kind for damaged bytes
        raise InputError.at(
            str(path),
            wanted="a flight log of PX4 (ULog)",
            found=f"damage: {' '.join(str(error).split())[:120] or type(error).__name__}",
            fix="download it again",
        ) from None
    truncation = f"{path.name} ends in the middle of a message, the rows before are read"
    return Recording(tuple(topics.values()), () if len(complete) == len(content) else (truncation,))


def _complete_messages(content: bytes) -> bytes:
    """The content up to its last whole message: a log ends wherever the power failed.

    Raises
    ------
    ValueError
        It is no log, or there are bytes between the messages.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("the first bytes are not those of a ULog")
    offset = _HEADER
    while offset + 3 <= len(content):
        size, kind = struct.unpack_from("<HB", content, offset)
        if kind not in _TYPES:
            raise ValueError(f"no message begins at byte {offset}")
        if offset + 3 + size > len(content):
            break
        offset += 3 + size
    return content[:offset]
