"""Integer semantics against apytypes, an independent library."""

from typing import Any

import numpy as np
import pytest
from apytypes import APyFixed, OverflowMode, QuantizationMode
from hypothesis import example, given, settings
from hypothesis import strategies as st

from boresight.model.words.fixed import Arithmetic, Format, leading_sign_count
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Term, Value

WORDS = st.sampled_from([18, 21, 24, 27, 32])


def word_strategy(word: int) -> st.SearchStrategy[int]:
    low, high = -(1 << (word - 1)), (1 << (word - 1)) - 1
    return st.one_of(st.integers(low, high), st.sampled_from([low, low + 1, -1, 0, 1, high]))


@st.composite
def groups(draw: Any) -> Any:
    word = draw(WORDS)
    n = draw(st.integers(1, 5))
    products = [
        (
            draw(word_strategy(word)),
            draw(word_strategy(word)),
            draw(st.integers(8, 31)),
            draw(st.booleans()),
        )
        for _ in range(n)
    ]
    return word, products, draw(st.sampled_from(list(Overflow)))


def run_group(word: int, products: Any, overflow: Any) -> Any:
    """The group through the interpreter: (result, saturated)."""
    values = [Value(f"v{k}", Kind.INPUT, 0, 0, 0, "test") for k in range(2 * len(products))]
    values.append(Value("q", Kind.OP, 0, 0, 0, "test"))
    terms = tuple(
        Term(2 * k, 2 * k + 1, s, negate=Negate.YES if neg else Negate.NO)
        for k, (_, _, s, neg) in enumerate(products)
    )
    dest = len(values) - 1
    program = Program(
        "g",
        Arithmetic(word=word),
        tuple(values),
        (Op(dest, terms, overflow),),
        tuple(range(dest)),
        (dest,),
        ("q",),
        (),
        (),
    )
    words = np.array([[x] for a, b, _, _ in products for x in (a, b)], dtype=np.int64)
    out, saturated = Interpreter(program).update(words)
    return int(out[0, 0]), bool(saturated[0])


@settings(max_examples=400)
@given(groups())
@example((32, [(-(1 << 31), -(1 << 31), 8, False)] * 5, Overflow.SAT))
@example((32, [(-(1 << 31), (1 << 31) - 1, 8, True)] * 5, Overflow.WRAP))
def test_group_is_what_apytypes_says(case: Any) -> None:
    word, products, overflow = case
    arith = Arithmetic(word=word)
    guard = arith.guard
    total = APyFixed(0, int_bits=62 - guard, frac_bits=guard)
    for a, b, shift, negative in products:
        # a * b / 2^shift in units of the accumulator's last bit: a has `shift` fraction bits.
        product = APyFixed.from_float(a, int_bits=word, frac_bits=0) * APyFixed.from_float(
            b, int_bits=word, frac_bits=0
        )
        scaled = APyFixed(
            product.to_bits(), int_bits=2 * word - shift - guard, frac_bits=shift + guard
        )
        term = scaled.cast(int_bits=62 - guard, frac_bits=guard, quantization=QuantizationMode.TRN)
        total = (total - term if negative else total + term).cast(
            int_bits=62 - guard, frac_bits=guard
        )
    limited = overflow in (Overflow.SAT, Overflow.CLIP)
    mode = OverflowMode.SAT if limited else OverflowMode.WRAP
    want = total.cast(int_bits=word, frac_bits=0, quantization=QuantizationMode.RND, overflow=mode)
    exact = total.cast(int_bits=62, frac_bits=0, quantization=QuantizationMode.RND)
    got, saturated = run_group(word, products, overflow)
    assert got == int(float(want))
    clamped = int(float(exact)) != int(float(want)) and overflow is Overflow.SAT
    assert saturated == clamped


def test_words_of_far_finer_bits_than_one() -> None:
    """2^1030 is no float64, 2^-1005 times it is a word."""
    fmt = Format(32, 1030)
    assert fmt.quantise(np.array([2.0**-1005, -(2.0**-1006)])).tolist() == [2**25, -(2**24)]
    assert fmt.real(np.array([2**25])).tolist() == [2.0**-1005]


@given(st.integers(18, 32), st.floats(-1e9, 1e9), st.integers(-3, 40))
def test_quantise_is_rnd_sat(word: int, value: Any, frac: int) -> None:
    fmt = Format(word, frac)
    want = APyFixed.from_float(value, int_bits=40, frac_bits=60).cast(
        int_bits=word - frac,
        frac_bits=frac,
        quantization=QuantizationMode.RND,
        overflow=OverflowMode.SAT,
    )
    exact = APyFixed.from_float(value, int_bits=40, frac_bits=60)
    if float(exact) == value:  # the oracle holds the value itself
        assert fmt.real(fmt.quantise(value)) == float(want)


@given(st.integers(18, 32), st.floats(-1e6, 1e6), st.floats(0, 1e6))
def test_for_range_holds_the_range_and_no_finer_format_does(
    word: int, low: float, width: float
) -> None:
    fmt = Format.for_range(word, low, low + width)
    assert fmt.min <= low and low + width <= fmt.max
    finer = Format(word, fmt.frac + 1)
    if max(abs(low), abs(low + width)) > 0:
        assert low < finer.min or low + width > finer.max


@pytest.mark.parametrize("word", [18, 24, 32])
def test_leading_sign_count_by_definition(word: int) -> None:
    arith = Arithmetic(word=word)
    rng = np.random.default_rng(1)
    x = rng.integers(arith.min_int, arith.max_int + 1, 2000) >> rng.integers(0, word, 2000)
    x = np.concatenate([x, [0, -1, 1, arith.min_int, arith.max_int, -2]])
    for value, n in zip(x, leading_sign_count(x, arith), strict=True):
        bits = f"{int(value) & ((1 << word) - 1):0{word}b}"
        copies = len(bits) - len(bits.lstrip(bits[0])) - 1
        assert n == min(copies, arith.norm_max)


@pytest.mark.parametrize("word", [17, 33, 0, -1])
def test_word_outside_18_to_32_is_refused(word: int) -> None:
    with pytest.raises(ValueError, match=rf"^word must be 18 to 32 bits, not {word}$"):
        Arithmetic(word=word)


@pytest.mark.parametrize("word", [18, 32])
def test_a_range_of_zero_alone_has_the_bits_of_a_fraction(word: int) -> None:
    assert Format.for_range(word, 0.0, 0.0) == Format(word, word - 1)


def test_binary_angles_fill_the_word_where_their_range_is_within_one_turn() -> None:
    ranges = ((-1.0, 1.0), (-1.0, 1.5), (-1.5, 1.0))
    assert [Format.declared(18, *r, "ht").frac for r in ranges] == [17, 16, 16]
