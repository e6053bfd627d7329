"""`firmware.body`: names, and the statements of small operations."""

import pytest

from boresight.firmware.body import Body
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.program import (
    Kind,
    Negate,
    Op,
    Overflow,
    Program,
    Scale,
    Term,
    Value,
    When,
)


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


def test_plain_operation() -> None:
    assert statements(Op(3, (Term(0, 1, 22), Term(0, 0, 3, negate=Negate.YES)))) == [
        "const int32_t v0_x = in->x; // fixed<32,1>, half turns, [-1, 1]",
        "bool saturated = false;",
        "uint64_t acc; // accumulator, modulo 2^64",
        "",
        "// y: fixed<32,1>, half turns, [-1, 1], SAT",
        "acc = ROUND;",
        "acc += mul_shift(v0_x, INT32_MIN, 22u); // k",
        "acc -= mul_shift(v0_x, v0_x, 3u);",
        "const int32_t v3_y = saturate(acc, &saturated);",
        "",
    ]


def test_flag_norm_and_table() -> None:
    lines = statements(
        Op(
            3,
            (
                Term(0, None, 9, 2, negate=Negate.UNLESS, when=When.IF, fraction_a=True),
                Term(0, 2, 5, fraction_b=True, scale=Scale.EVEN, when=When.UNLESS),
            ),
            Overflow.WRAP,
            flag=2,
            flag_quarter=True,
            norm=0,
            index=0,
            index_quarter=True,
            table=1,
        )
    )
    assert lines[-9:-1] == [
        "// y: fixed<32,1>, half turns, [-1, 1], WRAP",
        "flag = sign_mask_quarter(v2_s);",
        "n = sign_count(v0_x);",
        "segment = &TABLE[512u + 4u * segment_index_quarter(v0_x)];",
        "acc = ROUND;",
        "acc += negate_where(mul_shift(fraction(v0_x), segment[2], 9u), ~flag) & flag;",
        "acc += mul_shift(v0_x, fraction(v2_s), shift_less(5u, n & ~1u)) & ~flag;",
        "const int32_t v3_y = wrap(acc);",
    ]


def test_what_no_term_asks_for_is_left_out() -> None:
    lines = statements(Op(3, (Term(0, 0, 22),), flag=2, norm=2, index=2, table=0), outputs=())
    assert not any("v2_s" in line for line in lines)
    assert lines[-2] == "(void) v3_y;"


@pytest.mark.parametrize(
    ("name", "prefix", "wanted"),
    [
        ("ekf 9", None, "ekf_9"),
        ("ekf", "flight", "flight"),
        ("int32", None, "int32_program"),
        ("size", None, "size_program"),
    ],
)
def test_name(name: str, prefix: str | None, wanted: str) -> None:
    assert Body(program(Op(3, ()), name=name), prefix=prefix).name == wanted


def test_bad_prefix() -> None:
    with pytest.raises(ValueError, match=r"^prefix must be a C identifier, not '2 be'$"):
        Body(program(Op(3, ())), prefix="2 be")
