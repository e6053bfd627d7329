"""Lowering: the proof that no group can overflow, operations in integers, and refusals."""

import itertools
import sys
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.attitude.complementary import Complementary
from boresight.model.attitude.ekf_quaternion import EkfQuaternion
from boresight.model.errors import InputError
from boresight.model.lowering.lower import lower
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic, leading_sign_count
from boresight.model.words.interpreter import Interpreter, compiled
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Scale, When
from tests.support.random_functions import random_functions

# -- one operation against Python's integers ------------------------------------------------------


def is_normalised(program: Program, op: Op) -> bool:
    """Whether it moves a word by the count of another one, which is no smaller."""
    return program.values[op.dest].name.startswith("normalised")


def magnitudes(program: Any, op: Any) -> Any:
    """Largest |product|, and largest magnitude of each term whatever the words: by its extremes."""
    arith = program.arithmetic
    table = np.array(program.table_memory)

    def extremes(number: Any, is_fraction: Any) -> Any:
        if is_fraction:
            return (0, (1 << arith.fraction_bits) - 1)
        v = program.values[number]
        return (v.initial,) if v.kind is Kind.CONST else (arith.min_int, arith.max_int)

    largest, out = 0, []
    for t in op.terms:
        if t.coefficient is not None:
            column = table[512 * op.table : 512 * (op.table + 1)].reshape(-1, 4)[:, t.coefficient]
            second = (int(column.min()), int(column.max()))
        else:
            second = extremes(t.b, t.fraction_b)
        counts = range(arith.norm_max + 1) if t.scale is not Scale.NONE else (0,)
        term = 0
        for n in counts:
            less = {Scale.NONE: 0, Scale.FULL: n, Scale.EVEN: n & ~1, Scale.HALF: n >> 1}[t.scale]
            assert less <= t.shift <= arith.shift_max
            first = extremes(t.a, t.fraction_a)
            if t.a == op.norm or is_normalised(program, op):  # the count n says how large it can be
                first = (-1 << (arith.word - 1 - n), (1 << (arith.word - 1 - n)) - 1)
            for a, b in itertools.product(first, second):
                largest = max(largest, abs(a * b))
                term = max(term, abs((a * b) >> (t.shift - less)))
        out.append(term)
    return largest, out


def programs() -> Any:
    for word in (18, 21, 22, 24, 27, 28, 32):
        yield Complementary().compile(word=word)
        yield EkfQuaternion().compile(word=word)
        for seed in range(8):
            with suppress(InputError):
                yield random_functions(seed, word)[0]
        for turns in range(12, 26):  # prescribed formats, up to and beyond what one group can do
            g = Tracer("close")
            x = g.leaf("input", "x", -(2.0**turns), 2.0**turns * 0.999)
            yield lower(
                Trace(
                    g,
                    [x],
                    {
                        "wrap": ops.wrap_ht(x),
                        "clamp": ops.saturated(x + 0.5, 1.0),
                        "both": ops.wrap_ht(x + 0.5 * x),
                    },
                ),
                Arithmetic(word=word),
            )[0]


def test_no_accumulator_can_overflow() -> None:
    """For every operation, for all words: products fit int64, sums fit the accumulator."""
    closest = 0.0
    for program in programs():
        arith = program.arithmetic
        for op in program.ops:
            largest, terms = magnitudes(program, op)
            assert largest < 1 << 63
            total = (1 << (arith.guard - 1)) + sum(terms)
            assert total < 1 << (arith.acc_width - 1), program.values[op.dest].name
            closest = max(closest, total / (1 << (arith.acc_width - 1)))
    assert closest > 0.5  # the check is not about a limit out of sight


def run_in_integers(program: Any, op: Any, words: Any) -> Any:
    """The operation in Python's integers, straight from the definition in `model.words.fixed`."""
    arith = program.arithmetic
    half, modulus = 1 << (arith.word - 1), 1 << arith.word
    mask = (1 << arith.fraction_bits) - 1

    def plus_quarter(x: Any, yes: Any) -> Any:
        return (x + yes * (half >> 1) + half) % modulus - half

    flag = op.flag is not None and plus_quarter(words[op.flag], op.flag_quarter) < 0
    n = int(leading_sign_count(np.array(words[op.norm]), arith)) if op.norm is not None else 0
    acc = 1 << (arith.guard - 1)
    for t in op.terms:
        a = words[t.a] & mask if t.fraction_a else words[t.a]
        if t.coefficient is not None:
            index = plus_quarter(words[op.index], op.index_quarter) >> arith.fraction_bits
            b = program.table_memory[512 * op.table + 4 * (index & 127) + t.coefficient]
        else:
            b = words[t.b] & mask if t.fraction_b else words[t.b]
        less = {Scale.NONE: 0, Scale.FULL: n, Scale.EVEN: n - n % 2, Scale.HALF: n // 2}[t.scale]
        r = (a * b) // 2 ** max(t.shift - less, 0)
        minus = {Negate.NO: False, Negate.YES: True, Negate.IF: flag, Negate.UNLESS: not flag}[
            t.negate
        ]
        takes = {When.ALWAYS: True, When.IF: flag, When.UNLESS: not flag}[t.when]
        acc += takes * (-r if minus else r)
        assert -(1 << (arith.acc_width - 1)) <= acc < 1 << (arith.acc_width - 1)
    q = acc // 2**arith.guard
    if op.overflow in (Overflow.WRAP, Overflow.RANGE):
        return (q + half) % modulus - half, False
    return min(max(q, -half), half - 1), op.overflow is Overflow.SAT and not -half <= q < half


@pytest.mark.parametrize("word", [18, 32])
def test_every_operation_on_extreme_words(word: int) -> None:
    """All operands at their extremes, at random signs: equal to exact integers, step by step."""
    rng = np.random.default_rng(word)
    runs = 24
    for program in (Complementary().compile(word=word), random_functions(1, word)[0]):
        arith = program.arithmetic
        table = np.array(program.table_memory)
        edge = np.array([arith.min_int, arith.max_int, 0, -1, 1 << (word - 2), arith.min_int + 1])
        for op in (op for op in program.ops if not is_normalised(program, op)):
            alone = replace(program, ops=(op,))
            words = [
                np.full(runs, v.initial) if v.kind is Kind.CONST else rng.choice(edge, runs)
                for v in program.values
            ]
            single = [[int(w[k]) for w in words] for k in range(runs)]
            wanted = [run_in_integers(program, op, w) for w in single]
            clamped = np.reshape(compiled(alone, arrays=True)(words, table), (-1, runs))
            flags = np.broadcast_to(clamped.any(axis=0), runs)
            assert [*zip(words[op.dest].tolist(), flags.tolist(), strict=True)] == wanted
            update = compiled(alone, arrays=False)
            raised = [any(update(w, program.table_memory)) for w in single]
            assert [*zip((w[op.dest] for w in single), raised, strict=True)] == wanted


def test_rounding_is_half_up(trace: Any) -> None:
    """One product, rounded once: within half a unit, and the mean error is nil."""
    t = trace(lambda a, b: a * b, [(-0.999, 0.999)] * 2, 18)
    rng = np.random.default_rng(9)
    fixed, floats, _ = t.run(*rng.uniform(-0.99, 0.99, (2, 20_000)))
    units = (fixed[0] - floats[0]) / t.formats()[0].lsb
    assert np.abs(units).max() <= 0.5 + 2.0**-t.program.arithmetic.guard
    assert abs(units.mean()) < 0.04  # truncated guard bits: 2^-5


# -- structure ------------------------------------------------------------------------------------


def test_a_constant_or_an_input_may_be_an_output(trace: Any) -> None:
    t = trace(lambda a: (a, 0.75, a), [(-1.0, 1.0)])
    fixed, floats, _ = t.run([0.5, -0.25])
    assert not t.program.ops
    for y, want in zip(fixed, floats, strict=True):
        assert np.array_equal(y, want)


@pytest.mark.parametrize("word", [18, 32])
def test_a_tiny_term_in_a_huge_sum(trace: Any, word: int) -> None:
    """Products below the last bit are left out or computed apart, and leave no dead values."""
    t = trace(
        lambda a, b, c: (
            c + a * b,
            c + 2.0 * a,
            c + a * ops.rsqrt(b),
            ops.bounded(a * 2.0**-80, 0.0, 1.0, "nothing"),
        ),
        [(1e-9, 1e-8), (1e-9, 1e-8), (-1e9, 1e9)],
        word,
    )
    fixed, floats, saturated = t.run([2e-9, 8e-9], [5e-9, 8e-9], [1e6, -1e6])
    for y, want, fmt in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() <= fmt.lsb
    assert not saturated.any()
    used = {n for op in t.program.ops for n in op.operands()} | set(t.program.outputs)
    assert set(t.op_values()) <= used
    assert all(op.terms for op in t.program.ops)


@pytest.mark.parametrize("word", [18, 32])
def test_terms_below_the_last_bit_still_add_up(trace: Any, word: int) -> None:
    small = 0.45 * 2.0 ** (31 - word)
    t = trace(
        lambda a, b, c, d: (a + b + c + d, a + 8.0 * (b * (c * (0.1 / small)))),
        [(-1e9, 1e9), *[(0.0, 2 * small)] * 3],
        word,
    )
    assert t.formats()[0].lsb == 2.0 ** (31 - word)
    fixed, floats, _ = t.run([0.0, 1e6], *[[2 * small] * 2] * 3)
    for y, want, fmt in zip(fixed, floats, t.formats(), strict=True):
        assert np.abs(y - want).max() <= (0.5 + 2.0**-2) * fmt.lsb


def test_unit_ht_is_the_words_own_format_only_within_one_turn() -> None:
    g = Tracer("angles")
    angle, turns = g.leaf("input", "angle", -1.0, 1.0, "ht"), g.leaf("input", "turns", -8, 8, "ht")
    program = lower(Trace(g, [angle, turns], {"y": angle + turns}), Arithmetic())[0]
    assert [program.values[n].frac for n in program.inputs] == [31, 27]


# -- refusals -------------------------------------------------------------------------------------


def test_unbounded_ranges_are_refused_by_name(trace: Any) -> None:
    with pytest.raises(
        InputError,
        match=r"^test_lower\.py, line \d+: wanted a finite range, found inverse_root in \[1, inf"
        r"\]; declare it with ops\.bounded, or limit it with ops\.clip$",
    ):
        trace(lambda a: ops.named("inverse_root", ops.rsqrt(a)), [(0.0, 1.0)])


def test_more_than_63_bits_is_refused_by_name(trace: Any) -> None:
    with pytest.raises(
        InputError,
        match=r"^test_lower\.py, line \d+, test, value monster: wanted terms up to 2\.1e\+06 "
        r"in a value of \[-1, 1\], found x0 \* 2\^300 up to 2\.04e\+90, 279 bits too many; narrow "
        r"its factors, or choose units in which they are smaller \(x0 \[-1, 1\]\)$",
    ):
        trace(
            lambda a: ops.named("monster", ops.bounded(a * 2.0**300, -1.0, 1.0, "wrong")),
            [(-1.0, 1.0)],
        )


def test_only_a_factor_of_a_root_is_said_to_be_one(trace: Any) -> None:
    with pytest.raises(InputError, match=r", found x1 \* 2\^300 up to .* \(x1 \[-1, 1\]\)$"):
        trace(
            lambda a, b: ops.bounded(a * ops.rsqrt(a) + b * 2.0**300, -1.0, 1.0, "wrong"),
            [(1.0, 2.0), (-1.0, 1.0)],
        )


def test_an_unbounded_factor_under_a_prescribed_format_is_refused_by_name(trace: Any) -> None:
    with pytest.raises(
        InputError,
        match=r"^test_lower\.py, line \d+, test, value clamped: wanted terms up to 512 in .*, "
        r"found x1 \* its root \* 2\^-1 up to 2\.05e\+03, 2 bits too many; a root or reciprocal "
        r"in it has no upper bound: declare the product's range with ops\.bounded "
        r"\(x1 \[-1, 1\] and x0 \[0, 1\]\)$",
    ):
        trace(
            lambda a, b: ops.named("clamped", ops.saturated(b * ops.rsqrt(a), 2.0**-12)),
            [(0.0, 1.0), (-1.0, 1.0)],
        )


@pytest.mark.parametrize("power", [249, 250])
def test_a_binary_point_has_an_end(trace: Any, power: int) -> None:
    def wrong(a: Any) -> Any:
        return ops.bounded(a * 2.0**power, -1.0, 1.0, "wrong")

    if power == 249:
        assert trace(wrong, [(-1.0, 1.0)]).formats()[0].frac == -200
    else:
        with pytest.raises(InputError, match="bits too many"):
            trace(wrong, [(-1.0, 1.0)])


def test_chains_of_thousands_of_operations() -> None:
    g = Tracer("chain")
    u = g.leaf("input", "u", -1.0, 1.0)
    total = last = u
    for k in range(3000):
        total = total + (0.5 if k % 2 else -0.25) * u
        last = ops.bounded(0.5 * last - u * (1.0 / (k + 2)), -4.0, 4.0, "at most 2")
    program, _ = lower(Trace(g, [u], {"total": total, "last": last}), Arithmetic())
    words = program.format(program.inputs[0]).quantise(np.array([[-1.0, 0.3, 0.999]]))
    out, saturated = Interpreter(program, 3).update(words)
    x = program.format(program.inputs[0]).real(words[0])
    want = 0.0
    for k in range(3000):
        want = 0.5 * want - 1.0 / (k + 2)
    for number, word, wanted in zip(
        program.outputs, out, ((1.0 + 1500 * 0.25) * x, want * x), strict=True
    ):  # each product is rounded down
        fmt = program.format(number)
        assert np.abs(fmt.real(word) - wanted).max() <= 3000 / 2**8 * fmt.lsb
    assert len(program.ops) > 3000 and not saturated.any()


def test_calls_nest_as_deep_as_a_chain_that_takes_most_for_each_node() -> None:
    g = Tracer("chain")
    last = u = g.leaf("input", "u", -1.0, 1.0)
    for k in range(2000):
        last = ops.named(f"n{k}", last + u)
    before = sys.getrecursionlimit()
    program, _ = lower(Trace(g, [u], {"last": last}), Arithmetic())
    assert len(program.ops) == 2000 and sys.getrecursionlimit() == before
