"""The estimator's frame: parameters, float runs, compilation, quantised inputs."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import (
    Estimator,
    Input,
    Output,
    Param,
    State,
    input_words,
    param_words,
)
from tests.support.compiled_float import numpy_float
from tests.support.estimators import ALL

pytestmark = pytest.mark.pythons


class Leaky(Estimator):
    """y' = y + rate * (u - y): small enough to follow by hand."""

    name = "leaky"
    summary = "first-order low pass"
    inputs = (Input("u", -2.0, 2.0, "m"), Input("v", -1.0, 1.0, "m"))
    params = (
        Param("rate", 0.5, 0.0, 1.0, "1", "small follows slowly"),
        Param("offset", 0.0, -1.0, 1.0, "m", "added to the output"),
    )
    states = (State("y", -2.0, 2.0, "m", 1.0),)
    outputs = (Output("y", "m"), Output("sum", "m"))
    urgent = 1

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + p.rate * (u.u - x.y)
        return {"y": y}, {"y": y, "sum": y + u.v + p.offset}


def test_defaults_and_given_parameters() -> None:
    assert Leaky().param_values() == {"rate": 0.5, "offset": 0.0}
    assert Leaky().param_values({"rate": 1}) == {"rate": 1.0, "offset": 0.0}
    assert Leaky().param_values({"offset": -1.0})["offset"] == -1.0


@pytest.mark.parametrize("value", [-0.1, 1.1, math.nan, math.inf, "0.5"])
def test_parameters_outside_their_range_are_refused(value: Any) -> None:
    with pytest.raises(
        InputError,
        match=rf"^parameter rate: wanted 0 to 1 1, found {value!r}; "
        rf"choose a value inside the range$",
    ):
        Leaky().param_values({"rate": value})


def test_unknown_parameters_are_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"^parameter ratio: wanted one of rate, offset, found "
        r"'ratio'; correct the name$",
    ):
        Leaky().param_values({"ratio": 0.5})


def test_float_run() -> None:
    inputs = np.array([[[1.0, 0.0], [0.0, 0.25]], [[1.0, 2.0], [0.5, 0.0]]])
    out = numpy_float(Leaky(), inputs, params={"rate": 0.25, "offset": 0.125})
    assert np.array_equal(out["y"], [[1.0, 0.75], [1.0, 1.0625]])
    assert np.array_equal(out["sum"], [[1.125, 1.125], [1.625, 1.1875]])


def test_input_words_saturate() -> None:
    program = Leaky().compile(word=18)
    words = input_words(program, np.array([[[9.0, -9.0, 0.5], [1.0, -1.0, 0.25]]]))
    assert words.tolist() == [[[131071, -131072, 1 << 14], [1 << 16, -(1 << 16), 1 << 14]]]


def test_param_words_name_every_parameter() -> None:
    program = Leaky().compile()
    words = param_words(program, {"rate": 1.0, "offset": 0.5})
    assert words == {program.find("rate"): 1 << 30, program.find("offset"): 1 << 29}


@pytest.mark.parametrize("word", [17, 33])
def test_width_is_checked(word: int) -> None:
    with pytest.raises(
        InputError,
        match=rf"^word: wanted 18 to 32 bits, found {word}; choose a "
        rf"width inside the range$",
    ):
        Leaky().compile(word=word)


@pytest.mark.parametrize("name", sorted(ALL))
def test_every_estimator_declares_itself(name: str) -> None:
    e = ALL[name]()
    assert e.name == name and e.summary
    assert all(d.meaning for d in (*e.inputs, *e.params))
    assert e.compile(word=max(18, e.least_word)).output_names == tuple(o.name for o in e.outputs)


def test_names_and_summaries_by_default() -> None:
    class AlphaBeta(Estimator):
        """Follows a line. Not more."""

        outputs = (Output("pos", "m"), Output("vel", "m/s"))

    assert (AlphaBeta.name, AlphaBeta.summary) == ("alphabeta", "Follows a line. Not more")


def test_nodes_know_their_lines() -> None:
    program, nodes = Leaky().compile_traced()
    (out,) = (n for n, v in enumerate(program.values) if n == program.outputs[1])
    assert nodes[out].line.startswith("test_estimator.py, line ")
    assert nodes[program.inputs[0]].line == ""


class Watched(Leaky):
    """The same with a status word."""

    outputs = (Output("y", "m"), Output("status", "bits"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        states, outputs = super().step(x, u, p)
        return states, {"y": outputs["y"], "status": ops.where(u.v < 0.0, 1.0, 0.0)}


def test_meanings_are_told_and_change_no_identity() -> None:
    """Of inputs; of the bits of a status word, where its output says nothing itself."""
    plain, documented = Watched(), Watched()
    documented.inputs = tuple(replace(i, meaning=f"what {i.name} is") for i in Watched.inputs)
    documented.status_bits = {0: "late", 3: "odd"}
    programs = [e.compile() for e in (plain, documented)]
    assert programs[0].digest == programs[1].digest
    assert [port.meaning for port in programs[1].in_ports] == ["what u is", "what v is"]
    assert [p.ports[-1].meaning for p in programs] == ["", "0: late; 3: odd"]
    documented.outputs = (
        *documented.outputs[:-1],
        replace(documented.outputs[-1], meaning="its own"),
    )
    assert documented.compile().ports[-1].meaning == "its own"


@pytest.mark.parametrize("name", ALL)
def test_every_status_word_of_ours_says_its_bits(name: str) -> None:
    e = ALL[name]()
    assert bool(e.status_bits) == any(output.name == "status" for output in e.outputs)
