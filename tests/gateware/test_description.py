"""The description of a core: parameters with ranges, words of records, and the way to JSON."""

import json

import pytest

from boresight.firmware.build import CModel
from boresight.gateware.core import Core, build_core
from boresight.gateware.description import Description, describe
from boresight.gateware.engine.engine import Engine
from boresight.gateware.registers import FIXED, Access
from boresight.model import ops
from boresight.model.attitude.complementary import Complementary
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.tools.reading import Malformed, typed
from tests.support.bench import put, read, run_bench, write


class Awkward(Estimator):
    """Names and ranges that are hard to write down."""

    name = "awkward"
    summary = "y' = y + a u"
    inputs = (Input("u", -1.0, 1.0, "m|s"),)
    params = (
        Param("status", -0.5, -1.0, 1.0, "a*/b", "named as a register of every core | and more"),
        Param("STATUS", -0.25, -3.0, -0.25, "", "the same, but for the case"),
        Param("in_u", 1e-3, 0.0, 4e-3, "1/s", 'named as an input\'s constant; <small> & "fine"'),
        Param("int", 3e5, 0.0, 1e6, "?\\", "a word of C; large"),
    )
    states = (State("y", -4.0, 4.0, ""),)
    outputs = (Output("y", "m"),)
    urgent = 1

    def step(self, x, u, p):
        gain = ops.saturated(p.status + p.STATUS + p.in_u + p.int, 1.0)
        y = ops.saturated(x.y + gain * u.u, 4.0)
        return {"y": y}, {"y": y}


def awkward(word: int) -> Core:
    return build_core(Awkward().compile(word=word), "small")


@pytest.fixture(scope="module")
def complementary() -> Core:
    return build_core(Complementary().compile(), "fast")


def test_every_parameter_is_there_with_its_range(complementary: Core) -> None:
    result = describe(complementary)
    assert [r.name for r in result.parameters] == [p.name for p in Complementary.params]
    for param, register in zip(Complementary.params, result.parameters, strict=True):
        assert register.address == complementary.parameter_addresses[param.name]
        assert (register.low, register.high) == (param.low, param.high)
        assert (register.unit, register.meaning) == (param.unit, param.meaning)
        assert register.access is Access.WRITE_ONLY
        lsb = 2.0**-register.frac
        for word, value in (
            (register.minimum, param.low),
            (register.maximum, param.high),
            (register.reset, param.default),
        ):
            assert abs(word * lsb - value) <= lsb / 2
        assert register.minimum <= register.reset <= register.maximum


def test_words_of_the_records(complementary: Core) -> None:
    (records,) = describe(complementary, {"complementary": "a line"}).programs
    plan = complementary.schedule
    assert records.summary == "a line" and records.interval == plan.interval
    assert describe(complementary).programs[0].summary == "complementary"
    for word, declared in zip(records.inputs, Complementary.inputs, strict=True):
        assert (word.name, word.unit) == (declared.name, declared.unit)
        assert (word.low, word.high) == (declared.low, declared.high)
    for word, output in zip(records.outputs, Complementary.outputs, strict=True):
        assert (word.name, word.unit) == (output.name, output.unit)
        assert word.meaning.startswith(output.meaning)
    assert records.latencies == plan.latencies


@pytest.mark.parametrize("word", [18, 32])
def test_the_core_answers_at_these_addresses(word: int) -> None:
    core = awkward(word)
    result = describe(core)
    dut = Engine(machine=core.machine, image=core.image)
    words = [r.minimum // 2 + r.maximum // 4 for r in result.parameters[:3]] + [3]
    model = CModel(core.program)
    for register, given in zip(result.parameters, words, strict=True):
        model.set_param(register.name, given)

    status = FIXED[0]  # the program's "status" is another register
    bits = {field.name: 1 << field.bit for field in status.fields}
    unit = int(core.program.format(core.program.inputs[0]).quantise(1.0))

    async def bench(ctx):
        async def flags():
            return await read(ctx, dut.bus, status.address)

        async def named(name: str) -> int:
            return await read(ctx, dut.bus, result.find(name).address)

        ctx.set(dut.o.ready, 1)
        await ctx.tick().repeat(25)
        assert (await named("build_low"), await named("build_high")) == result.build
        assert await named("updates") == 0
        assert await flags() == bits["idle"] | bits["parity"]  # once: the states were loaded
        assert [r.name for r in result.parameters] == ["status", "STATUS", "in_u", "int"]
        for register, given in zip(result.parameters, words, strict=True):
            await write(ctx, dut.bus, register.address, given)
        await put(ctx, dut.i, {"data": unit, "last": 1})
        (output,) = await ctx.tick().sample(dut.o.payload.data).until(dut.o.valid)
        assert output == model.update([[unit]])[0][0, 0] & result.mask
        await ctx.tick().repeat(20)
        assert await named("updates") == 1
        assert await flags() == bits["idle"]
        await put(ctx, dut.i, {"data": unit, "last": 0})
        await put(ctx, dut.i, {"data": unit, "last": 1})
        await ctx.tick().repeat(5)
        assert await flags() & bits["framing"]
        for field in status.fields:
            if field.clear:
                await write(ctx, dut.bus, status.address, 1 << field.bit)
                assert not await flags() & 1 << field.bit
        assert await named("updates") == 1

    run_bench(dut, bench)


def test_json_is_read_back(complementary: Core) -> None:
    """All that a register map holds: registers as they are, words by name, format and unit."""
    description = describe(complementary)
    result = typed(Description, json.loads(description.to_json()))
    assert result.registers == description.registers and result.build == description.build
    assert result.to_json() == description.to_json()
    (records,) = result.programs
    assert [w.frac for w in records.inputs] == [w.frac for w in description.programs[0].inputs]


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"registers": {}}, ", registers"),
        ({"word": "32"}, ", word"),
        ({"programs": [{"program": "x", "digest": "", "inputs": []}]}, ", programs[0], outputs"),
    ],
)
def test_what_is_no_description(change: dict, place: str, complementary: Core) -> None:
    data = json.loads(describe(complementary).to_json())
    with pytest.raises(Malformed) as error:
        typed(Description, {**data, **change})
    assert error.value.location == place


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("name", (None, 5)),
        ("address", (None, 4096, -1, True)),
        ("access", ("", 1)),
        ("frac", (-129, 129, 1.0)),
        ("width", (0, 33)),
        ("minimum", (-(2**31) - 1,)),
        ("maximum", (2**32,)),
        ("reset", ("0", 2**32)),
        ("signed", (1,)),
        ("names", ("ab", [1])),
        ("fields", ({}, [{"bit": 0, "meaning": ""}])),
    ],
)
def test_what_a_register_may_not_be(key: str, values: tuple, complementary: Core) -> None:
    for value in values:
        data = json.loads(describe(complementary).to_json())
        data["registers"][1][key] = value
        with pytest.raises(Malformed) as error:
            typed(Description, data)
        assert error.value.location.startswith(f", registers[1], {key}")


def test_identifiers_are_unique() -> None:
    names = describe(awkward(32)).identifiers
    assert [names[r.address] for r in FIXED] == [r.name for r in FIXED]
    assert [names[k] for k in range(4)] == ["status_2", "STATUS_3", "in_u", "int"]
    assert len({name.upper() for name in names.values()}) == len(names)
