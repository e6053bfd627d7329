"""The complete board under cocotb: Python hears the attitude on the host's line."""

from boresight.sim.board.build import make_board
from boresight.sim.board.run import judge, stimulus
from boresight.sim.board.setup import SCALED
from boresight.sim.synthetic import synthetic_log
from tests.support.board.cocotb_run import run_under_cocotb

UPDATES = 100


def test_every_frame_equals_the_models() -> None:
    board = make_board(SCALED, filters=("complementary",), restarts=1)
    what = stimulus(synthetic_log(seconds=1, rate_hz=1024, seed=2), board)
    run = run_under_cocotb(board, what, updates=UPDATES, settings={"output_divider": 1})
    verdict = judge(board, what, run, filter=0, source=2)
    assert (verdict.mismatches, verdict.first) == (0, "")
    assert verdict.updates == len(run.frames) == UPDATES
