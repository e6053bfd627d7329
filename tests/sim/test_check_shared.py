"""The proof of several estimators on one core: passes as shipped, fails when one is wrong."""

from __future__ import annotations

import dataclasses

import pytest

from model.errors import InputError
from model.estimators import estimator
from sim.bundled import bundled
from sim.check_shared import check_shared, shared_core
from sim.log import read_log

NAMES = ("complementary", "complementary_as_printed")


@pytest.fixture(scope="module")
def log():
    return read_log(bundled("ximu_walk"))


@pytest.fixture(scope="module")
def core():
    return shared_core([estimator(n) for n in NAMES])


def test_all_agree_in_turns(log, core):
    results = check_shared([estimator(n) for n in NAMES], log, steps=250, simulator="verilator",
                           core=core)
    assert [r.estimator for r in results] == list(NAMES)
    for number, result in enumerate(results):
        assert result.good
        assert [x.level for x in result.levels] == ["fixed", "c", "rtl"]
        rtl = result.levels[-1]
        assert (rtl.n_total, rtl.n_mismatch) == (250, 0)
        assert rtl.cycles_predicted == core.select(number).schedule.latency
        assert rtl.interval_predicted == core.select(number).schedule.interval
    assert not (results[0].outputs == results[1].outputs).all()


def test_a_program_that_loses_its_states_fails(log, core):
    """The second program's first state lives where the first one's does: the image of a core
    whose registers overlap, which the checker would have refused."""
    image = core.image
    first, second = (core.parts[k].allocation.addresses() for k in range(2))
    states = [core.parts[k].schedule.program.states[-1] for k in range(2)]
    mine = {first[n] for n in states[0]}
    field = 1 << 9
    moves = dict(zip((second[n] for n in states[1]), sorted(mine), strict=True))

    def moved(word: int) -> int:
        for position in (0, 9):
            at = word >> position & (field - 1)
            if not (position == 9 and word >> 18 & 1):  # b_addr of a table
                word += (moves.get(at, at) - at) << position
        return word

    base, length = image.bases[1], image.lengths[1]
    rom = [moved(w) if base <= k < base + length else w for k, w in enumerate(image.rom)]
    dest = core.machine.word_bits - 5 - 9
    rom = [w + ((moves.get(w >> dest & (field - 1), w >> dest & (field - 1))
                 - (w >> dest & (field - 1))) << dest) if base <= k < base + length else w
           for k, w in enumerate(rom)]
    assert rom != image.rom
    wrong = dataclasses.replace(core, image=dataclasses.replace(image, rom=rom))
    results = check_shared([estimator(n) for n in NAMES], log, steps=120, simulator="verilator",
                           levels=("rtl",), core=wrong)
    bad = [r for r in results if not r.good]
    assert bad
    for result in bad:
        level = result.levels[-1]
        assert level.n_mismatch > 0
        assert level.divergence.startswith(f"rtl: outputs differ, step {level.first_wrong}, with 2")


def test_a_missing_simulator_fails_them_all(log, core, monkeypatch):
    monkeypatch.setattr("sim.simulators._missing", lambda name: f"{name} not found: install it")
    results = check_shared([estimator(n) for n in NAMES], log, steps=3, simulator="icarus",
                           levels=("rtl",), core=core)
    assert [r.levels[-1].error for r in results] == ["icarus not found: install it"] * 2
    assert not any(r.good for r in results)


def test_parameters_are_of_their_estimator(log):
    results = check_shared([estimator(n) for n in NAMES], log, steps=30, levels=("fixed",),
                           params=[None, {"kp_roll_per_s": 4.0}])
    plain = check_shared([estimator(n) for n in NAMES], log, steps=30, levels=("fixed",))
    assert (results[0].outputs == plain[0].outputs).all()
    assert not (results[1].outputs == plain[1].outputs).all()


def test_bad_options_are_refused(log):
    with pytest.raises(InputError, match=r"^steps: wanted 1 or more, found 0; .*$"):
        check_shared([estimator(n) for n in NAMES], log, steps=0)
