"""Estimators of one core whose inputs others give: formats, first words, mistakes."""

import dataclasses
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.model.declarations import Input, Output, SourceFormat
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.linking import families, first_word, linked_estimators, linked_words
from boresight.model.lowering.profile import Profile
from boresight.model.words.interpreter import Interpreter
from tests.support.linked import Inner, Middle, Outer
from tests.support.shared import STATES, Motion, Row


def reader(*inputs: Input) -> Estimator:
    """An estimator called reader that adds its inputs."""

    class Reader(Estimator):
        outputs = (Output("sum"),)

        def step(self, x, u, p):
            return {}, {"sum": sum(1.0 * getattr(u, i.name) for i in self.inputs)}

    made = Reader()
    made.inputs = inputs
    return made


def test_inputs_take_the_format_of_their_source() -> None:
    outer, middle, inner = linked_estimators([Outer(), Middle(), Inner()])
    assert [i.source_format for i in inner.inputs] == [None, None]
    # [-8, 8] would have 28 fraction bits; the source has one value in [-0.9, 0.9] and 31.
    assert (
        middle.inputs[0].source_format == SourceFormat(31, -0.9, 0.9)
        and not middle.inputs[0].beyond
    )
    source, program = middle.compile(), outer.compile()
    assert program.format(program.inputs[1]) == source.format(source.outputs[0])
    assert outer.inputs[1].beyond


def test_estimators_apart_stay_as_they_are() -> None:
    outer, inner = Outer(), Inner()
    assert linked_estimators([inner]) == [inner]
    error = Middle()
    assert linked_estimators([error]) == [error]
    assert error.compile().digest == Middle().compile().digest
    result = linked_estimators([outer, inner])
    assert result[1] is inner and [i.source_format is None for i in result[0].inputs] == [
        1,
        1,
        0,
        1,
    ]
    assert outer.inputs[2].source_format is None, "the caller's object changed"


def test_words_beyond_the_range_are_clamped_in_the_program() -> None:
    outer = linked_estimators([Outer(), Middle(), Inner()])[0]
    program = outer.compile()
    form = program.format(program.inputs[1])
    for value, seen in ((-3.0, -1.5), (-1.2, -1.2), (0.9, 0.9), (1.7, 1.0)):
        rows = [[0], [int(form.quantise(value))], [0], [0]]
        out = Interpreter(program).update(np.array(rows))[0][1, 0]
        assert abs(program.format(program.outputs[1]).real(out) - seen) < 1e-8


def test_first_words() -> None:
    inner = Inner().compile()
    assert first_word(inner, "half") == 3 << 29  # the state's 0.75
    assert first_word(inner, "product") == 0
    above = dataclasses.replace(inner.values[inner.outputs[1]], low=0.5)
    values = list(inner.values)
    values[inner.outputs[1]] = above
    inner = dataclasses.replace(inner, values=tuple(values))
    assert first_word(inner, "product") == inner.format(inner.outputs[1]).quantise(0.5)


def test_held() -> None:
    """The reader's updates come before the source's first, then after its second and third."""
    words = np.array([10, 20, 30])
    assert linked_words(words, np.array([0, 0, 2, 3, 3]), 7).tolist() == [7, 7, 20, 30, 30]


Z = Input("z", -1.0, 1.0)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        (
            (Z, Input("x", -1.0, 1.0, "m", source="inner.whole")),
            "estimator reader, input x: wanted an output of inner: half, product, found 'whole'",
        ),
        (
            (Z, Input("x", -1.0, 1.0, "cm", source="inner.half")),
            "estimator reader, input x: wanted the unit of inner.half, m, found cm",
        ),
        (
            (Z, Input("x", -1.0, 0.5, "m", source="inner.half")),
            r"estimator reader, input x: wanted a range that holds \[-0.9, 0.9\] m of inner.half, "
            r"found \[-1, 0.5\]; widen it, or declare clamp=True",
        ),
        (
            (Input("x", -1.0, 1.0, "m", source="inner.half"),),
            "estimator reader: wanted an input that comes with the record",
        ),
        (
            (Z, Input("x", -1.0, 1.0, source="reader.sum")),
            "estimator reader: wanted programs that do not wait for each other's words, found "
            "reader reads reader",
        ),
    ],
)
def test_mistakes(inputs: tuple[Input, ...], message: str) -> None:
    with pytest.raises(InputError, match=rf"^(test_linking\.py, line \d+, )?{message}"):
        linked_estimators([reader(*inputs), Inner()])


@pytest.mark.parametrize("source", ["inner", "inner.", ".half", "inner.half.x"])
def test_a_source_is_a_program_and_its_output(source: str) -> None:
    with pytest.raises(
        InputError,
        match=r'^test_linking\.py, line \d+, input x: wanted source="PROGRAM.OUTPUT", found',
    ):
        Input("x", -1.0, 1.0, source=source)


def test_families() -> None:
    """The owner need not be there; and an estimator alone has its own states."""
    assert families([Row(), Inner(), Motion()]) == (2, 1, 2)
    assert families([Row(), Inner()]) == (0, 1)
    made = [Row(), Motion()]
    assert linked_estimators(made) == made


def changed(of: type[Estimator], **attributes: Any) -> Estimator:
    return type(of.__name__, (of,), {"name": of.name, **attributes})()


WIDER = (STATES[0], replace(STATES[1], high=4.0), STATES[2])


@pytest.mark.parametrize(
    ("others", "message"),
    [
        (
            [Row(), changed(Motion, shares="last"), changed(Row, name="last", shares="")],
            r"estimator row: wanted the estimator that has the states, which shares no other's, "
            r"found shares = 'motion'",
        ),
        (
            [Row(), changed(Motion, states=WIDER)],
            r"wanted the states of motion: State\(name='pace', .*high=4.0.*, found .*high=2.0",
        ),
        ([Row(), changed(Motion, states=STATES[:2])], r"wanted .* no more, found State\(name='wei"),
        (
            [changed(Row, profile=Profile("row", "", (), {})), Motion()],
            r"estimator row: wanted states in the formats of those of motion",
        ),
        (
            [Row(), Motion(), reader(Z, Input("x", -8.0, 8.0, "m", source="motion.place"))],
            r"estimator reader, input x: wanted no link to or from programs that share states",
        ),
    ],
)
def test_states_that_cannot_be_shared(others: list[Estimator], message: str) -> None:
    with pytest.raises(InputError, match=message):
        linked_estimators(others)
