"""PX4's flight logs, ``.ulg``, by pyulog."""

from __future__ import annotations

import io
import struct
from collections.abc import Collection
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np

from boresight.model.errors import InputError
from boresight.model.tools.extras import optional
from boresight.sim.records.reading import read_bytes
from boresight.sim.records.topics import Recording, Topic

__all__ = ["read_ulog"]

#: First bytes, length of the header, and types of messages.
_MAGIC, _HEADER, _TYPES = b"ULog\x01\x12\x35", 16, b"BFIMPQADRLCSO"
#: Whole messages that show where the log goes on behind damaged bytes.
_FOLLOWING = 8


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
    read = optional("pyulog").ULog
    notes = []
    try:
        complete, lost, is_cut = _complete_messages(content)
        if is_cut:
            notes.append(f"{path.name} ends in the middle of a message, the rows before are read")
        with redirect_stdout(io.StringIO()):  # pyulog prints remarks
            log = read(io.BytesIO(complete), None if wanted is None else list(wanted))
        if lost or log.file_corruption:
            rows = ", and rows behind them" if log.file_corruption else ""
            notes.append(f"{path.name}: damaged, {lost} bytes are left out{rows}")
        topics: dict[str, Topic] = {}
        for data in log.data_list:
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
    return Recording(tuple(topics.values()), tuple(notes))


def _complete_messages(content: bytes) -> tuple[bytes, int, bool]:
    """The whole messages, how many bytes between them are none, and whether the last one is cut.

    A log ends wherever the power failed, and a bad sector damages its middle.

    Raises
    ------
    ValueError
        It is no log.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("the first bytes are not those of a ULog")
    parts, offset, lost = [content[:_HEADER]], _HEADER, 0
    while offset + 3 <= len(content):
        end = _message_end(content, offset)
        if end is None:
            start = offset
            while offset + 3 <= len(content) and not _begins(content, offset):
                offset += 1
            lost += offset - start
            continue
        if end > len(content):
            return b"".join(parts), lost, True
        parts.append(content[offset:end])
        offset = end
    return b"".join(parts), lost, offset < len(content) and not lost


def _message_end(content: bytes, offset: int) -> int | None:
    """Where the message that begins here ends; None if none does."""
    size, kind = struct.unpack_from("<HB", content, offset)
    return offset + 3 + size if kind in _TYPES else None


def _begins(content: bytes, offset: int) -> bool:
    """Whether several whole messages follow from here."""
    for _ in range(_FOLLOWING):
        if offset == len(content):
            return True
        end = _message_end(content, offset) if offset + 3 <= len(content) else None
        if end is None or end > len(content):
            return False
        offset = end
    return True
