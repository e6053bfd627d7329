"""The complete board against the integer models, word by word; and a judge that bites."""

import dataclasses

import numpy as np
import pytest

from boresight.gateware.boards.frames import Decoder, Kind
from boresight.gateware.system.attitude_frame import WORDS, attitude_of, parse_line, text_line
from boresight.model.errors import InputError
from boresight.sim.board.run import frame_ends, judge, run_board, stimulus, writes
from boresight.sim.records.nine_axis import NineAxis
from tests.support.board.shared import COMPLEMENTARY, MEKF

from .conftest import UPDATES


def test_every_frame_equals_the_models(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert (verdict.mismatches, verdict.first) == (0, "")
    assert verdict.updates == len(plain.frames) == len(plain.trace.samples) == UPDATES
    assert verdict.lines >= 2 and verdict.fields >= 2
    assert plain.dropped == plain.trace.violations == len(plain.trace.broken) == 0


def test_latency_is_the_stated_one(board, what, plain) -> None:
    verdict = judge(board, what, plain, filter=COMPLEMENTARY, source=2)
    assert verdict.transfer_cycles == (board.system.transfer_cycles,) * 2
    assert sum(
        verdict.transfer_cycles[:1] + verdict.core_cycles[:1]
    ) == board.system.latency_cycles(COMPLEMENTARY)
    least, most = verdict.core_cycles
    assert least == most <= board.system.plan.lengths[COMPLEMENTARY] + 100  # 1 us at 100 MHz


def test_no_sample_is_lost(board, what, plain) -> None:
    assert judge(board, what, plain, filter=COMPLEMENTARY, source=2).lost == 0
    assert np.array_equal(np.diff(plain.frames[:, 0] & 0xFFFF), np.ones(UPDATES - 1))


@pytest.mark.parametrize("word", WORDS)
def test_one_wrong_bit_is_seen(word: str, board, what, plain) -> None:
    frames = plain.frames.copy()
    frames[UPDATES // 2, WORDS.index(word)] ^= 1 << (20 if word == "header" else 0)
    verdict = judge(
        board, what, dataclasses.replace(plain, frames=frames), filter=COMPLEMENTARY, source=2
    )
    assert verdict.mismatches == 1 and f"update {UPDATES // 2}" in verdict.first


def test_one_lost_sample_is_seen(board, what, plain) -> None:
    trace = plain.trace
    gone = dataclasses.replace(
        trace, samples=np.delete(trace.samples, 5), updates=np.delete(trace.updates, 5)
    )
    frames = plain.frames[:-1]
    verdict = judge(
        board,
        what,
        dataclasses.replace(plain, trace=gone, frames=frames),
        filter=COMPLEMENTARY,
        source=2,
    )
    assert verdict.lost == 1


def test_another_sample_or_line_is_seen(board, what, plain) -> None:
    counts = what.counts.copy()
    counts[UPDATES // 2, 2] += 1
    assert (
        judge(
            board, dataclasses.replace(what, counts=counts), plain, filter=COMPLEMENTARY, source=2
        ).mismatches
        > 0
    )
    compass = what.compass.copy()
    compass[0, 0] += 1
    assert (
        judge(
            board, dataclasses.replace(what, compass=compass), plain, filter=COMPLEMENTARY, source=2
        ).mismatches
        > 0
    )


def test_no_frames_is_no_pass(board, what, plain) -> None:
    silent = dataclasses.replace(plain, frames=plain.frames[:0])
    verdict = judge(board, what, silent, filter=COMPLEMENTARY, source=2)
    assert verdict.mismatches == 1 and verdict.updates == 0


def test_magnetometer_counts(board, what) -> None:
    run = run_board(
        board,
        what,
        updates=1200,
        settings={"filter": MEKF, "magnetic_source": 1, "compass_mode": 2, "output_divider": 1},
    )
    verdict = judge(board, what, run, filter=MEKF, source=1)
    assert (verdict.mismatches, verdict.first) == (0, "")
    # The compass wakes up with headings and has to be told.
    assert not run.trace.lines[0].counts and run.trace.lines[-1].counts
    assert verdict.fields >= 1
    last = attitude_of(run.frames[-1].tolist())
    assert not {"inertial_fault", "saturated"} & set(last.flag_names)


def test_text_and_divider(board, what) -> None:
    settings = {"filter": COMPLEMENTARY, "output_mode": 2, "output_divider": 4}
    run = run_board(board, what, updates=60, settings=settings)
    pieces = run.trace.data.replace(b"\xc0", b"\n").decode("latin-1").split("\n")
    kept = [line for line in pieces if parse_line(line)]
    assert len(kept) == 60 // 4
    decoder = Decoder(word=32)
    assert [kind for kind, _ in decoder.feed(run.trace.data)] == [Kind.WRITE] * 3  # the answers
    attitude = parse_line(kept[-1])
    assert attitude is not None and attitude.quaternion is None


def test_text_and_binary_say_the_same(plain) -> None:
    words = plain.frames[-1].tolist()
    assert abs(parse_line(text_line(words)).heading - attitude_of(words).heading) < 0.006


def test_ends_of_frames(plain) -> None:
    ends = frame_ends(plain.trace)
    assert len(ends) == UPDATES and np.all(np.diff(ends) > 0)
    assert np.all(ends > plain.trace.updates)


def test_writes_are_frames(board) -> None:
    text = writes(board, {"filter": 1})
    data = bytes(int(line.split()[1], 16) for line in text.splitlines())
    address = board.system.map().find("filter").address
    assert list(Decoder(word=32).feed(data)) == [(Kind.WRITE, [address, 1])]


def test_a_log_needs_an_attitude(board) -> None:
    zeros = np.zeros((4, 3))
    log = NineAxis("bare", np.arange(4.0), zeros, zeros, zeros).record()
    with pytest.raises(InputError, match="wanted a reference attitude"):
        stimulus(log, board)
