"""The proof of several estimators on one core: passes as shipped, fails when one is wrong."""

from __future__ import annotations

import dataclasses

import pytest

from boresight.gateware.microcode.assemble import decode, encode
from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.sim.compare.check_shared import check_shared, shared_core
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record

NAMES = ("complementary", "complementary_as_printed")


@pytest.fixture(scope="module")
def log():
    return read_record(bundled("ximu_walk"))


@pytest.fixture(scope="module")
def core():
    return shared_core([estimator(n) for n in NAMES])


def test_all_agree_in_turns(log, core):
    results = check_shared(
        [estimator(n) for n in NAMES], log, steps=250, simulator="verilator", core=core
    )
    assert [r.estimator for r in results] == list(NAMES)
    for number, result in enumerate(results):
        assert result.good
        assert [x.level for x in result.levels] == ["fixed", "c", "rtl"]
        rtl = result.levels[-1]
        assert (rtl.n_total, rtl.n_mismatch) == (250, 0)
        assert rtl.cycles_predicted == core.select(number).schedule.latency
        assert rtl.interval_predicted == core.select(number).schedule.interval
    assert not (results[0].outputs == results[1].outputs).all()


def test_programs_that_share_states_fail(log, core):
    """Microcode that the checker would have refused: one's states live where the other's do."""
    image, machine = core.image, core.machine
    first, second = (
        [part.allocation.addresses()[n] for pair in part.schedule.program.states for n in pair]
        for part in core.parts
    )
    there = dict(zip(second, first, strict=True))
    base = image.bases[1]
    rom = list(image.rom)
    for k in range(base, base + image.lengths[1]):
        word = decode(machine, rom[k])
        for field in ("a_addr0", "b_addr0", "dest0"):
            if not (field == "b_addr0" and word["table0"]):
                word[field] = there.get(word[field], word[field])
        rom[k] = encode(machine, word)
    wrong = dataclasses.replace(core, image=dataclasses.replace(image, rom=rom))
    results = check_shared(
        [estimator(n) for n in NAMES],
        log,
        steps=60,
        simulator="verilator",
        levels=("rtl",),
        core=wrong,
    )
    bad = [r.levels[-1] for r in results if not r.good]
    assert bad
    for level in bad:
        assert level.n_mismatch > 0
        assert level.divergence == (
            f"rtl: outputs differ, step {level.first_wrong}, with 2 programs in turns"
        )


def test_a_missing_simulator_fails_them_all(log, core, monkeypatch):
    monkeypatch.setattr(
        "boresight.sim.rtl.simulators._missing", lambda name: f"{name} not found: install it"
    )
    results = check_shared(
        [estimator(n) for n in NAMES], log, steps=3, simulator="icarus", levels=("rtl",), core=core
    )
    assert [r.levels[-1].error for r in results] == ["icarus not found: install it"] * 2
    assert not any(r.good for r in results)


def test_parameters_are_of_their_estimator(log):
    results = check_shared(
        [estimator(n) for n in NAMES],
        log,
        steps=30,
        levels=("fixed",),
        params=[None, {"kp_roll_per_s": 4.0}],
    )
    plain = check_shared([estimator(n) for n in NAMES], log, steps=30, levels=("fixed",))
    assert (results[0].outputs == plain[0].outputs).all()
    assert not (results[1].outputs == plain[1].outputs).all()


def test_bad_options_are_refused(log):
    with pytest.raises(InputError, match=r"^steps: wanted 1 or more, found 0; .*$"):
        check_shared([estimator(n) for n in NAMES], log, steps=0)
