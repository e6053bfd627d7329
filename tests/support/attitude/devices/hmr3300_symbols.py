"""Hostile input for the HMR3300's reader: streams of bytes, and levels of the line."""

from __future__ import annotations

import random
from collections.abc import Iterable

from tests.support.attitude.devices.hmr3300_grammar import (
    BROKEN,
    PAUSE,
    counts_sentence,
    heading_sentence,
)

#: Characters near those of the grammar.
_NEAR = b"0123456789 .,-+#I*\r\n/:;'\t\x0b\x0c\x8d\x8a\xb0Q"


def _sentence(rng: random.Random) -> bytes:
    """A sentence that is good, or beyond a limit by little, or by much."""
    if rng.random() < 0.5:
        edge = rng.choice((3599, 3600, 900, 901, 9999))
        values = [
            rng.choice((rng.randint(0, 3599), edge)),
            *(
                rng.choice((rng.randint(-900, 900), rng.choice((900, -900, 901, -901, 0))))
                for _ in range(2)
            ),
        ]
        return heading_sentence(*values)
    edge = rng.choice((32_767, -32_767, 32_768, -32_768, 65_535, 65_536, 99_999, -98_304, 0))
    values = [
        rng.choice(
            (
                rng.randint(-2000, 2000),
                rng.randint(-32_767, 32_767),
                rng.randint(-99_999, 99_999),
                edge,
            )
        )
        if rng.random() < 0.3
        else rng.randint(-32_767, 32_767)
        for _ in range(3)
    ]
    return counts_sentence(*values)


def _mutated(text: bytes, rng: random.Random) -> bytes:
    """One to three bytes put in, taken out, changed, doubled, zeros in front; or the line cut."""
    out = bytearray(text)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(out) + 1)
        how = rng.randrange(7)
        if how == 0:
            out.insert(at, rng.choice(_NEAR))
        elif how == 1:
            out[at : at + 1] = b""
        elif how == 2:
            out[at : at + 1] = bytes([rng.choice(_NEAR)])
        elif how == 3:
            out[at:at] = out[at : at + 1] * rng.randint(1, 8)
        elif how == 4:
            out[at:at] = b" " * rng.randint(1, 9)
        elif how == 5:
            digits = [
                k
                for k in range(len(out))
                if out[k : k + 1].isdigit() and not (k and chr(out[k - 1]) in "0123456789.")
            ]
            at = rng.choice([*digits, 0])
            out[at:at] = b"0" * rng.randint(1, 4)
        elif rng.random() < 0.3:
            del out[at:]
    return bytes(out)


def _piece(rng: random.Random) -> bytes:
    """Some bytes of one kind."""
    kind = rng.random()
    if kind < 0.4:
        return _sentence(rng)
    if kind < 0.75:
        return _mutated(_sentence(rng), rng)
    if kind < 0.85:
        return bytes(rng.choice(_NEAR) for _ in range(rng.randint(1, 40))) + b"\n"
    if kind < 0.9:
        return rng.choice(
            (
                b"#I\r\n",
                b"#\r\n",
                b"#I",
                b"\r\n",
                b"\n",
                b"#D12\r\n",
                b"##I\r\n",
                b"HMR3300 Rev 1.0\r\n",
                b" #I\r\n",
                b"1.0, 2.0,#I\r\n",
            )
        )
    # Without an end most of the time, this would swallow the lines after it.
    return rng.randbytes(rng.randint(1, 60)) + rng.choice((b"", b"\n", b"\r\n"))


def hostile_bytes(size: int, *, seed: int, broken: float = 0.0, pauses: float = 0.0) -> list[int]:
    """A stream of ``size`` symbols that begins and ends with LF.

    Parameters
    ----------
    size : int, >= 2
        Number of symbols.
    seed : int
        Of the random numbers.
    broken : float
        Part of the bytes that become `BROKEN`.
    pauses : float
        How often a `PAUSE` comes after a byte.
    """
    rng = random.Random(seed)
    out: list[int] = [ord("\n")]
    while len(out) < size - 1:
        for byte in _piece(rng):
            out.append(BROKEN if rng.random() < broken else byte)
            if rng.random() < pauses:
                out.append(PAUSE)
    return [*out[: size - 1], ord("\n")]


def hostile_line(
    symbols: Iterable[int], *, divisor: int, glitch: int, seed: int
) -> list[tuple[int, int]]:
    """Levels of a line that carries ``symbols``, as well as a bad line may.

    Bytes come at rates of up to +-3 % beside the right one (+-1.5 % with glitches), with and
    without gaps, with short pulses in and between them, false starts in the gaps; framing errors
    are stop bits that are low, for a moment or for long.

    Parameters
    ----------
    symbols : iterable of int
        Bytes, or `BROKEN`.
    divisor : int
        Cycles of a bit.
    glitch : int
        Longest pulse that the receiver says it does not see, cycles.
    seed : int
        Of the random numbers.

    Returns
    -------
    list of (level, cycles)
    """
    rng = random.Random(seed)
    levels: list[int] = [1] * (2 * divisor)
    for symbol in symbols:
        glitches = glitch > 0 and rng.random() < 0.3
        rate = rng.uniform(-0.015, 0.015) if glitches else rng.uniform(-0.03, 0.03)
        data = rng.randrange(256) if symbol == BROKEN else symbol
        bits = [0, *(data >> k & 1 for k in range(8)), symbol != BROKEN]
        start = len(levels)
        for k, bit in enumerate(bits):
            end = start + round((k + 1) * divisor * (1 + rate))
            levels += [int(bit)] * (end - len(levels))
        if symbol == BROKEN:
            levels += [0] * rng.choice((0, 0, rng.randint(0, 12 * divisor)))
            levels += [1] * (divisor + divisor // 2)
        elif rng.random() < 0.3:
            levels += [1] * rng.randint(0, 3 * divisor)
        if rng.random() < 0.02:  # a false start
            levels += [1] * divisor + [0] * rng.randint(1, divisor // 4) + [1] * (2 * divisor)
        at = start + rng.randint(0, 3 * divisor)
        while glitches and symbol != BROKEN and at + glitch < len(levels):
            for k in range(at, at + rng.randint(1, glitch)):
                levels[k] ^= 1
            at += rng.randint(2 * divisor, 8 * divisor)
    return _runs(levels)


def noise(cycles: int, *, seed: int, longest: int) -> list[tuple[int, int]]:
    """Levels that mean nothing, of 1 to ``longest`` cycles each."""
    rng = random.Random(seed)
    out: list[tuple[int, int]] = []
    left = cycles
    while left > 0:
        length = min(left, rng.randint(1, rng.choice((2, longest // 8 + 1, longest))))
        out.append((len(out) & 1, length))
        left -= length
    return out


def _runs(levels: list[int]) -> list[tuple[int, int]]:
    out: list[tuple[int, int]] = []
    begin = 0
    for k in range(1, len(levels) + 1):
        if k == len(levels) or levels[k] != levels[begin]:
            out.append((levels[begin], k - begin))
            begin = k
    return out
