"""The whole board with a soft core: hardware's attitude in its memory, software from the same."""

import re

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.attitude import estimator
from boresight.sim.attitude.board.run import Stimulus, stimulus
from boresight.sim.attitude.soc.board import BoardBench, attitude_image, soc_board
from boresight.sim.attitude.soc.offload import offload
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record

#: Cycles from new results in the registers to all of the attitude in memory.
MOST = 250


@pytest.fixture(scope="module")
def board() -> BoardBench:
    return soc_board(filters=("complementary",))


@pytest.fixture(scope="module")
def walk(board: BoardBench) -> Stimulus:
    return stimulus(read_record(bundled("ximu_walk")), board.board)


def test_offload(board: BoardBench, walk: Stimulus) -> None:
    system = board.board.system
    image = attitude_image(system, ram=board.ram)
    run = board.run(image, walk, updates=150)
    assert run.restarts == 0
    newest, shown = run.newest, run.shown
    numbers = newest.header & 0xFFFF
    assert numbers.tolist() == list(range(1, 151)), "every update, once"
    wanted, _ = CModel(board.board.core.parts[0].program).update(newest.inputs)
    assert (newest.outputs == wanted).all()
    assert (shown.header == newest.header).all()
    assert (shown.computed == wanted).all()
    took = newest.complete - run.updates[: len(numbers)]
    assert took[2:].max() <= MOST, "the first ones wait for the start-up"
    assert (run.updates - run.samples[: len(run.updates)] < 1000).all()
    lines = re.findall(
        r"h (\d+) (-?\d+\.\d\d) (-?\d+\.\d\d) (-?\d+\.\d\d) (\d+) (\d+)\r\n", run.console
    )
    assert [int(line[0]) for line in lines] == [128]
    heading, pitch, roll = (180.0 * word / 2**31 for word in wanted[127, [2, 0, 1]])
    assert np.allclose([float(v) for v in lines[0][1:4]], [heading, pitch, roll], atol=0.0051)
    assert run.console.startswith("boresight 1\r\n")


@pytest.mark.parametrize("single", [False, True])
def test_software_on_the_same_records(board: BoardBench, walk: Stimulus, single: bool) -> None:
    """It misses updates here, which come ten times as fast as from the sensor; time does not."""
    e, program = estimator("complementary"), board.board.core.parts[0].program
    image = attitude_image(board.board.system, software=e, single=single, ram=board.ram)
    run = board.run(image, walk, updates=120, keys=b"1?", keys_at=300_000)
    assert run.restarts == 0
    shown, newest = run.shown, run.newest
    assert 5 < len(shown.header) < len(newest.header)
    if single:
        records = np.stack(
            [program.format(n).real(shown.inputs[:, k]) for k, n in enumerate(program.inputs)],
            axis=1,
        )
        reference = e.run_float(records[..., None]).outputs
        for k, (name, n) in enumerate(zip(reference, program.outputs, strict=True)):
            error = np.abs(program.format(n).real(shown.computed[:-1, k]) - reference[name][:-1, 0])
            assert np.minimum(error, np.abs(error - 2.0)).max() < 1e-5, name
    else:
        wanted, _ = CModel(program).update(shown.inputs)
        assert (shown.computed[:-1] == wanted[:-1]).all()
    # The time of what was missed is in the next step.
    ends = np.searchsorted(newest.header & 0xFFFF, shown.header & 0xFFFF)
    total = np.cumsum(np.where(newest.inputs[:, 0] < 0, 0, newest.inputs[:, 0].astype(np.int64)))
    assert shown.inputs[1:, 0].tolist() == np.diff(total[ends]).tolist()
    line = re.search(
        r"missed (\d+) crashes 0 cause 0 pc 0 status \d+ stack (\d+) of \d+\r\n", run.console
    )
    assert line
    assert int(line[1]) > 0
    assert 100 < int(line[2]) < 1024


def test_figures_of_the_offload(board: BoardBench) -> None:
    row = offload(board, read_record(bundled("ximu_walk")), updates=20)
    assert (row["updates"], row["in_memory"], row["mismatches"]) == (20, 20, 0)
    assert 0 < row["update_to_memory_cycles"]["max"] <= MOST
    assert row["sample_to_update_cycles"]["min"] == row["sample_to_update_cycles"]["max"]


def test_sensor_faults_do_not_stop_it(board: BoardBench, walk: Stimulus) -> None:
    """No data-ready, a dead line, a sensor that resets: the firmware waits and goes on."""
    image = attitude_image(board.board.system, ram=board.ram)
    faults = "30 60 no_data_ready\n90 100 stuck_high\n160 161 reset\n"
    run = board.run(image, walk, updates=150, faults=faults)
    assert run.restarts == 0
    wanted, _ = CModel(board.board.core.parts[0].program).update(run.newest.inputs)
    assert (run.newest.outputs == wanted).all()
    steps = run.newest.inputs[1:, 0]
    assert steps.max() > 5 * np.median(steps), "samples were missing"
    assert len(run.newest.header) == len(run.updates)
