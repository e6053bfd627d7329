"""Names, helper functions and lines of the emitted C."""

import ctypes
import random
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.firmware.build import find_compiler
from boresight.firmware.emit import Body
from boresight.firmware.layout import block, definitions, helpers, identifier, literal, unique
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import Kind, Op, Program, Term, Value

# -- `firmware.emit`: names, and what is left out -------------------------------------------------


def value(name: str, kind: Kind, initial: int = 0) -> Value:
    return Value(name, kind, 31, -1.0, 1.0, "test", "half turns", initial)


def program(op: Op, *, name: str = "small", outputs: tuple[int, ...] = (3,)) -> Program:
    values = (
        value("x", Kind.INPUT),
        value("k", Kind.CONST, -(2**31)),
        value("s", Kind.STATE),
        value("y", Kind.OP),
    )
    return Program(
        name,
        Arithmetic(),
        values,
        (op,),
        (0,),
        outputs,
        tuple(f"o{k}" for k in range(len(outputs))),
        ((2, 2),),
        (0,) * 1024,
    )


def statements(op: Op, *, outputs: tuple[int, ...] = (3,)) -> list[str]:
    return Body(program(op, outputs=outputs)).statements(after=[])


def test_what_no_term_asks_for_is_left_out() -> None:
    lines = statements(Op(3, (Term(0, 0, 22),), flag=2, norm=2, index=2, table=0), outputs=())
    assert not any("v2_s" in line for line in lines)
    assert lines[-2] == "(void) v3_y;"


@pytest.mark.parametrize(
    ("name", "wanted"), [("ekf 9", "ekf_9"), ("int32", "int32_program"), ("size", "size_program")]
)
def test_name(name: str, wanted: str) -> None:
    assert Body(program(Op(3, ()), name=name)).name == wanted


def test_what_only_a_state_takes_over_is_loaded() -> None:
    delay = replace(program(Op(3, ())), states=((2, 0),))
    lines = Body(delay).statements(after=[])
    assert lines[0].startswith("const int32_t v0_x = in->x;")
    assert lines[-1] == "self->state.s = v0_x;"


# --------------------------------------------------------------------------------------------------
# the static functions: each against plain Python


@pytest.mark.parametrize("flags", [(), ("-U__GNUC__",)], ids=["gnu", "portable"])
@pytest.mark.parametrize("word", [18, 32])
def test_against_python(word: int, flags: tuple[str, ...], tmp_path: Path) -> None:
    arith = Arithmetic(word)
    calls = "mul_shift() sign_count() wrap() segment_index_quarter() fraction()"
    exports = [
        "uint64_t x_mul(int32_t a, int32_t b, uint32_t s) { return mul_shift(a, b, s); }",
        "uint32_t x_count(int32_t a) { return sign_count(a); }",
        "int32_t x_wrap(uint64_t a) { return wrap(a); }",
        "uint32_t x_index(int32_t a) { return segment_index_quarter(a); }",
        "int32_t x_fraction(int32_t a) { return fraction(a); }",
    ]
    text = "\n".join(["#include <stdint.h>", definitions(arith), helpers(calls), *exports, ""])
    (tmp_path / "x.c").write_text(text)
    subprocess.run(
        [find_compiler(), "-std=c99", "-O1", *flags, "-shared", "-fPIC", "x.c", "-o", "x.so"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    c = ctypes.CDLL(str(tmp_path / "x.so"))
    c.x_mul.argtypes = [ctypes.c_int32, ctypes.c_int32, ctypes.c_uint32]
    c.x_mul.restype, c.x_count.restype = ctypes.c_uint64, ctypes.c_uint32
    c.x_wrap.argtypes, c.x_index.restype = [ctypes.c_uint64], ctypes.c_uint32
    rng = random.Random(word)
    words = [0, 1, -1, 2, -2, arith.min_int, arith.max_int, 2 ** (word - 2), -(2 ** (word - 2))]
    words += [rng.randint(arith.min_int, arith.max_int) >> rng.randrange(word) for _ in range(200)]
    for a in words:
        count = sum((a if a >= 0 else ~a) < 2 ** (word - 1 - n) for n in range(1, word))
        assert c.x_count(a) == min(count, arith.norm_max)
        assert c.x_index(a) == (a + 2 ** (word - 2)) // 2**arith.fraction_bits % 128
        assert c.x_fraction(a) == a % 2**arith.fraction_bits
        for s in (0, 1, 13, 31):
            b = rng.choice(words)
            assert c.x_mul(a, b, s) == (a * b // 2**s) % 2**64
            q = a * b * 2 ** rng.randrange(2) // 2**arith.guard
            assert c.x_wrap((q * 2**arith.guard) % 2**64) == (
                (q + 2 ** (word - 1)) % 2**word - 2 ** (word - 1)
            )


# -- `firmware.layout`: legal and distinct, whatever the names of the values are -------------------


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("gx", "gx"),
        ("q.w", "q_w"),
        ("2nd", "n2nd"),
        ("int", "int_"),
        ("I", "I_"),
        ("bool", "bool_"),
        ("_Bool", "Bool"),
        ("INT32_MAX", "INT32_MAX_"),
        ("uint8_t", "uint8_t_"),
        ("", "unnamed"),
        ("Δψ", "unnamed"),
        ("µ_t", "t"),
        ("gyr[0]", "gyr_0_"),
    ],
)
def test_identifier(name: str, wanted: str) -> None:
    assert identifier(name) == wanted
    assert identifier(wanted) == wanted


@given(st.text())
def test_identifier_is_legal(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))


def test_unique_counts() -> None:
    assert unique(["q.w", "q_w", "Q_W", "q_w_2"]) == ["q_w", "q_w_2", "Q_W", "q_w_2_2"]
    assert unique(["gx", "GX"], reserved=["Gx"], fold=True) == ["gx_2", "GX_3"]


@given(st.lists(st.text(alphabet="ab_.2", max_size=4)), st.booleans())
def test_unique_is_unique(names: list[str], fold: bool) -> None:
    got = [x.upper() if fold else x for x in unique(names, reserved=["a"], fold=fold)]
    assert len({*got, "A" if fold else "a"}) == len(names) + 1


def test_literal() -> None:
    assert [literal(w) for w in (0, -1, 2**31 - 1, -(2**31))] == [
        "0",
        "-1",
        "2147483647",
        "INT32_MIN",
    ]


# -- `firmware.layout`: lines of at most 100 characters ------------------------------------------


def test_block_of_a_long_opening() -> None:
    """An argument a line, if the line with its brace has more than 100 characters."""
    long = "f" * 70
    fits = f"/* Sum. */\nvoid {long}(int a, int (*b)(void))"
    assert block(fits, []) == f"{fits} {{\n}}"
    assert block(fits.replace("f", "gf", 1), []) == (
        f"/* Sum. */\nvoid g{long}(\n    int a,\n    int (*b)(void)) {{\n}}"
    )
