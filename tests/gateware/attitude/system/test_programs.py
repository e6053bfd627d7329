"""The programs before the filters: interpreter, C and core agree word for word; all fit."""

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.attitude.system.programs import feed_of, system_core, system_estimators
from boresight.gateware.core import Core
from boresight.model.attitude import FILTERS
from boresight.model.attitude.front import FRONT, board_params
from boresight.model.declarations import Input, Output
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of
from boresight.model.words.interpreter import Interpreter
from tests.support.random_program import random_inputs


@pytest.mark.parametrize("word", [26, 32])
@pytest.mark.parametrize("name", sorted(FRONT))
def test_interpreter_and_c(name: str, word: int) -> None:
    program = FRONT[name]().compile(word=word)
    rows = np.array(random_inputs(program, 1, 300), dtype=np.int64)
    machine = Interpreter(program)
    wanted = [machine.update(row[:, None]) for row in rows]
    outputs, saturated = CModel(program).update(rows)
    assert (outputs == [out[:, 0] for out, _ in wanted]).all()
    assert (saturated == [bool(s[0]) for _, s in wanted]).all()


def initial(core: Core, filter: str, name: str) -> float:
    """Value of a parameter at power-up."""
    (program,) = (part.program for part in core.parts if part.program.name == filter)
    (node,) = (n for n, v in enumerate(program.values) if v.name == name)
    return program.format(node).real(program.values[node].initial)


def test_a_filter_is_told_the_sensors_full_scales() -> None:
    """Every filter on every board: each parameter whose text asks for it; one's own value wins."""
    told = [
        (filter, p.name, board_params([p])[p.name])
        for filter in FILTERS
        for p in estimator_of(filter).params
        if "full scale" in p.meaning and p.unit.endswith("^2")
    ]
    assert {name for _, name, _ in told} == {"gyro_most_sq", "force_most_sq", "gyro_max_sq"}
    core = system_core(FILTERS)
    for filter, name, wanted in told:
        assert initial(core, filter, name) == pytest.approx(wanted, rel=1e-6), (filter, name)
        assert wanted == pytest.approx({"g": 5.1, "f": 38.2}[name[0]] ** 2, rel=0.02)
    own = system_core(("mekf",), params={"mekf": {"gyro_most_sq": 9.0}})
    assert initial(own, "mekf", "gyro_most_sq") == pytest.approx(9.0)


def estimator(*inputs: Input, outputs: int = 1) -> Estimator:
    """One that adds its inputs."""

    class Sums(Estimator):
        def step(self, x, u, p):
            total = sum(1.0 * getattr(u, i.name) for i in self.inputs)
            return {}, {o.name: total for o in self.outputs}

    made = Sums()
    made.inputs = inputs
    made.outputs = tuple(Output(f"out{k}") for k in range(outputs))
    return made


def test_so_many_values_of_missing_fields() -> None:
    fields = [
        [Input(n, -200.0, 200.0, "uT", missing=first + k) for k, n in enumerate(("mx", "my", "mz"))]
        for first in (1.0, 4.0, 7.0)
    ]
    programs = [e.compile() for e in system_estimators([estimator(*f) for f in fields])[:3]]
    assert len(feed_of(programs[:2]).constants) == 6
    with pytest.raises(InputError, match="^estimators: wanted 8 or fewer different values"):
        feed_of(programs)


def test_inputs_take_the_words_of_the_sensors() -> None:
    """Whatever range they declare, as long as it holds the sensor's."""
    made = estimator(
        Input("gx", -100.0, 100.0, "rad/s"),
        Input("az", -160.0, 160.0, "m/s^2"),
        Input("dt", 0.0, 0.1, "s"),
        Input("x", -1.0, 1.0),
    )
    other = estimator(Input("x", -4.0, 4.0))
    other.name = "other"
    fed, second, inertial, *_ = system_estimators([made, other])
    programs = [e.compile() for e in (fed, second, inertial)]
    words = {
        n: programs[2].format(v)
        for n, v in zip(programs[2].output_names, programs[2].outputs, strict=True)
    }
    taken = {programs[0].values[n].name: programs[0].format(n) for n in programs[0].inputs}
    assert {n: taken[n] for n in ("gx", "az", "dt")} == {n: words[n] for n in ("gx", "az", "dt")}
    # The first that declares a register says its format; others take that.
    assert programs[1].format(programs[1].inputs[0]) == taken["x"]
    # A step below 0 or above 0.1 is limited in the program; the rest is as it comes.
    run = Interpreter(programs[0])
    for word, seen in ((-(2**31), 0.0), (2**31 - 1, 0.1), (2**28, 2**-5)):
        out = run.update(np.array([[0], [0], [word], [0]]))[0][0, 0]
        assert abs(programs[0].format(programs[0].outputs[0]).real(out) - seen) < 1e-6
    assert made.inputs[0].source_format is None, "the caller's object changed"


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (
            [estimator(Input("gx", -400.0, 400.0, "deg/s"))],
            "estimator sums, input gx: wanted the unit of the sensor, rad/s, found 'deg/s'",
        ),
        (
            [estimator(Input("az", -10.0, 10.0, "m/s^2"))],
            "estimator sums, input az: wanted a range that holds",
        ),
        (
            [estimator(Input("mx", -300.0, 300.0, "uT"))],
            "estimator sums, input mx: wanted what it reads between two lines of the compass",
        ),
        (
            [estimator(*(Input(f"x{k}", -1.0, 1.0) for k in range(17)))],
            "estimator sums: wanted 16 or fewer inputs on a board, found 17",
        ),
        (
            [estimator(Input("x", -1.0, 1.0), outputs=17)],
            "estimator sums: wanted 16 or fewer outputs on a board, found 17",
        ),
        (["mekf"] * 9, "estimators: wanted 8 or fewer on a board, found 9"),
    ],
)
def test_what_the_sensors_cannot_feed(made, message: str) -> None:
    with pytest.raises(InputError) as caught:
        system_estimators(made)
    assert message in str(caught.value)


def test_registers_of_one_name_must_fit_each_other() -> None:
    first, two = estimator(Input("x", -1.0, 1.0, "m")), estimator(Input("x", -1.0, 1.0, "s"))
    two.name = "two"
    with pytest.raises(InputError, match=r"input x: wanted the unit of the input register x, m"):
        system_estimators([first, two])
    names = [Input(f"x{k}", -1.0, 1.0) for k in range(33)]
    many = [estimator(*names[k : k + 11]) for k in (0, 11, 22)]
    for k, e in enumerate(many):
        e.name = f"many{k}"
    with pytest.raises(InputError, match=r"wanted 32 or fewer inputs without a sensor"):
        system_estimators(many)


def test_words_have_32_bits() -> None:
    with pytest.raises(InputError, match=r"^word: wanted 32 bits .*, found 30; leave --word out"):
        system_core(["complementary"], word=30)


def test_parameters_of_a_stranger_are_refused() -> None:
    with pytest.raises(InputError, match=r"^parameters of mekf: wanted one of complementary"):
        system_core(["complementary"], params={"mekf": {"tilt_var": 1e-3}})


def test_parameters_go_to_their_program() -> None:
    core = system_core(["complementary"], params={"calibrate_field": {"field_xx": 0.25}})
    program = core.parts[2].program
    assert program.values[program.find("field_xx")].initial == 1 << 30
