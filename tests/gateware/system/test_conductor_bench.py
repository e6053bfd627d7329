"""The script of samples, and what is read out of the bench's text."""

import numpy as np
import pytest

from boresight.sim.board.chain import COUNTS, NO_LINE, Samples
from tests.support.conductor_bench import _parse, sample_command, script_of


def test_script_sends_the_line_of_an_update_while_the_one_before_is_at_work() -> None:
    given = Samples(
        stamp=np.array([1, 2**32 - 1]),
        counts=np.array([[1, -1, 0, 0, 0, 0]] * 2),
        line=np.array([NO_LINE, COUNTS]),
        values=np.array([[0, 0, 0], [5, -5, 9]]),
        restart=np.array([True, True]),
        filter=np.array([2, 3]),
    )
    assert script_of(given, start=["u 1"]) == [
        "u 1",
        "f 2",
        "w 10",
        "s 1 1 ffff 0 0 0 0",
        "l 1 5 fffb 9",
        "n 1",
        "w 180",
        "f 3",
        "r",
        "s ffffffff 1 ffff 0 0 0 0",
        "n 2",
        "w 80",
    ]
    assert sample_command(-1, [0] * 6) == "s ffffffff 0 0 0 0 0 0"


def test_text_of_the_bench() -> None:
    played = _parse("S 5\nE 7 68\nU 9\nD 0 ffffffff\nD 1 7\nQ 0 1\nR 514 abc\n- done\n", 32)
    assert (played.sampled, played.updated) == ([5], [9])
    assert played.events == [(7, "restart"), (7, "watchdog")]
    assert played.results == [[-1, 7]]
    assert played.taken == [[1]]
    assert played.reads == [(514, 0xABC)]
    assert played.words(0, 2).tolist() == [[-1, 7]]
    with pytest.raises(ValueError, match=r"^the bench says 'bad command'$"):
        _parse("bad command\n", 32)
