"""Comparison of a sample's word with full scale."""

from __future__ import annotations

from amaranth.hdl import Const, Mux, Value


def at_full_scale(word: Value, select: Value, limits: tuple[int, int]) -> Value:
    """Expression: the magnitude of a signed 16-bit word is the selected limit or more.

    One comparison with a constant serves both signs: ``w >= limit`` is ``w > limit - 1``, and
    ``w <= -limit`` is ``~w >= limit - 1``. From the lowest bit on, the comparison with a constant
    is one AND or OR per bit, which packs five bits into a LUT.

    Parameters
    ----------
    word : Value
        16 bits.
    select : Value
        0 or 1: number of the limit.
    limits : (int, int)
        1 to 32767.
    """
    negative = word[15]
    result: Value = negative
    for k in range(15):
        bit = word[k] ^ negative
        with_bit = [result & bit if (limit - 1) >> k & 1 else result | bit for limit in limits]
        result = (
            with_bit[0]
            if (limits[0] - 1 ^ limits[1] - 1) >> k & 1 == 0
            else Mux(select, with_bit[1], with_bit[0])
        )
    return result & Const(1)
