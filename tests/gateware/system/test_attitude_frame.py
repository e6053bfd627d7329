"""Frames and lines in software."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.gateware.system.attitude_frame import (
    FORMATS,
    OUTPUTS,
    WORDS,
    Attitude,
    angle_text,
    attitude_of,
    parse_line,
    text_line,
)
from boresight.model.estimators import FILTERS, estimator

HALF = 1 << 31
WORD = st.integers(-HALF, HALF - 1)


@pytest.mark.parametrize(
    "value, text",
    [
        (0, "+000.00"),
        (HALF - 1, "+180.00"),
        (-HALF, "-180.00"),
        (-1, "-000.00"),
        (HALF // 2, "+090.00"),
        (-HALF // 180, "-001.00"),
        # half a hundredth is 59652.3 words
        (59_652, "+000.00"),
        (59_653, "+000.01"),
        (-59_652, "-000.00"),
        (-59_653, "-000.01"),
    ],
)
def test_known_angles(value: int, text: str) -> None:
    assert angle_text(value) == text


@given(WORD)
def test_angles_are_rounded_to_the_nearest(value: int) -> None:
    exact = value * 180 / HALF
    assert abs(float(angle_text(value)) - exact) <= 0.005 + 1e-12


def test_halves_go_away_from_zero() -> None:
    # 36000 n / 2^32 = k + 1/2 at n = 2^26 (2 m + 1) / 1125 only if 1125 divides 2 m + 1
    half = 2**26 * 1125 // 1125
    assert half * 36_000 % 2**32 == 2**31
    assert (angle_text(half), angle_text(-half)) == ("+005.63", "-005.63")  # 5.625


def test_attitude_of_words() -> None:
    words = [
        0x8128_FFFE - 2**32,
        -1,
        HALF // 2,
        -HALF // 4,
        -HALF,
        1 << 29,
        0,
        -(1 << 28),
        1,
        5 << 23,
    ]
    got = attitude_of(words)
    assert got == Attitude(
        number=0xFFFE,
        flags=0x8128,
        stamp=0xFFFF_FFFF,
        pitch=90.0,
        roll=-45.0,
        heading=-180.0,
        quaternion=(1.0, 0.0, -0.5, 2.0**-29),
        status=5,
    )
    assert attitude_of(words, {0: (30, 22)}).status == 10
    assert attitude_of(words, {1: (30, 22)}).status is attitude_of(words, {}).quaternion is None
    assert got.filter == 0
    assert got.flag_names == ("field_used", "restart", "inertial_fault")
    with pytest.raises(ValueError, match=r"^words must be 10, not 9$"):
        attitude_of(words[:-1])


@given(st.lists(WORD, min_size=len(WORDS), max_size=len(WORDS)))
def test_lines_come_back(words: list[int]) -> None:
    line = text_line(words)
    assert len(line) == 39 and line.endswith("\r\n")
    got, exact = parse_line(line), attitude_of(words)
    assert (got.number, got.flags) == (exact.number, exact.flags)
    if got.filter in FORMATS:
        bits = FORMATS[got.filter][1]
        assert got.status == exact.status & (1 << 32 - bits) - 1
    else:
        assert got.status is None
    for name in ("heading", "pitch", "roll"):
        assert math.isclose(getattr(got, name), getattr(exact, name), abs_tol=0.005_000_1)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "+001.00 +002.00 +003.00 0001 0000",
        "+001.00 +002.00 +003.00 0001 0000 00G",
        "001.00 +002.00 +003.00 0001 0000 000",
        "+001,00 +002.00 +003.00 0001 0000 000",
        "+001.00 +002.00 +003.00 0001 0000 000 ",
        "+001.00  +002.00 +003.00 0001 0000 000",
        "+0a1.00 +002.00 +003.00 0001 0000 000",
        "+001.00 +002.00 +003.00 0001 0000 00a",
    ],
)
def test_other_lines_are_none(line: str) -> None:
    assert parse_line(line) is None
    assert parse_line("+001.00 -002.00 +003.00 0001 0000 00A") == Attitude(
        number=1, heading=1.0, pitch=-2.0, roll=3.0, flags=0, status=1
    )


def test_formats_are_those_of_the_filters() -> None:
    for number, name in enumerate(FILTERS):
        program = estimator(name).compile()
        frac = {
            n: program.values[k].frac
            for n, k in zip(program.output_names, program.outputs, strict=True)
        }
        assert tuple(frac) == OUTPUTS
        assert {frac[n] for n in ("pitch", "roll", "heading")} == {31}
        assert {frac[n] for n in ("qw", "qx", "qy", "qz")} == {FORMATS[number][0]}
        assert frac["status"] == FORMATS[number][1] >= 20
    assert len(FORMATS) == len(FILTERS)
