"""The reader of the compass in simulation: every sentence, hostile input."""

import pytest

from boresight.sim.attitude.devices import COMPASS_FAULTS, device_text
from boresight.sim.rtl.simulators import available
from tests.support.attitude.devices.hmr3300_device_bench import Happened, run_reader

# --------------------------------------------------------------------------------------------------
# reader and model of the compass together, at the pins, in real time: start, modes, faults

pytestmark = pytest.mark.skipif(not available("verilator"), reason="needs Verilator")

DATA = [
    ((37 * k) % 3600, (13 * k) % 1200 - 600, (7 * k) % 1200 - 600, 100 * k % 4000 - 2000, -k, 5 * k)
    for k in range(400)
]
#: Cycle time of the sentences, s, and a sentence's own length with some to spare.
LINE, SENTENCE = 0.125, 0.015
BEGIN, END = 3.53, 6.03


def check_values(result: Happened) -> None:
    """Every accepted sentence is the one that the compass had."""
    for line in result.lines:
        assert line.values == DATA[line.slot][3 * line.is_counts :][:3]


def test_begins_by_itself() -> None:
    result = run_reader(DATA, seconds=5)
    check_values(result)
    assert 0.8 < result.lines[0].time < 0.8 + LINE + SENTENCE
    assert [line.slot for line in result.lines] == list(range(len(result.lines)))
    assert len(result.lines) == round((5 - 0.8) / LINE) - 1 or len(result.lines) == round(
        (5 - 0.8) / LINE
    )
    assert result.flags == [(result.flags[0][0], frozenset())]
    # Of the two lines of text the first has no line end before it.
    assert [name for _, name in result.events if name != "heading_line"] == ["rejected_line"]


@pytest.mark.parametrize(("ppm", "slower"), [(-30_000, 0), (30_000, 0), (0, 3)])
def test_other_rates(ppm: int, slower: int) -> None:
    result = run_reader(DATA, seconds=5, ppm=ppm, slower=slower)
    check_values(result)
    assert len(result.lines) >= 32 and not result.times("framing_error")


def test_kinds_of_sentences_as_wanted() -> None:
    result = run_reader(DATA, seconds=15, modes=[(4, 2), (9, 1)])
    check_values(result)
    for begin, end, counts in ((0, 4, False), (5, 9, True), (10, 15, False)):
        lines = [line for line in result.lines if begin < line.time < end]
        assert lines and all(line.is_counts == counts for line in lines)
        assert begin == 0 or len(lines) >= round((end - begin) / LINE) - 1
    assert len(result.times("command_sent")) == 6
    assert len(result.times("command_acknowledged")) == 4
    assert not result.times("invalid_command") and not result.times("command_timed_out")


def test_wanted_before_the_compass_is_awake() -> None:
    result = run_reader(DATA, seconds=5, modes=[(0, 2)])
    check_values(result)
    assert result.lines[-1].is_counts and result.lines[-1].time > 5 - LINE - SENTENCE


def test_single_letters() -> None:
    result = run_reader(
        DATA, seconds=6, commands=[(2, "Q"), (3, "S"), (4, "Q"), (4.3, "Q"), (5, "S")]
    )
    check_values(result)
    assert len(result.times("command_sent")) == 5
    (refused,) = result.times("invalid_command")  # *Q while it sends
    assert 2 < refused < 2.1
    assert sum(3.2 < line.time < 5 for line in result.lines) == 2
    assert sum(line.time > 5 for line in result.lines) >= 7


#: The event that says so, and within which time.
SIGNS = {
    "silence": ("went_stale", 0.56),
    "garbage": ("rejected_line", LINE + SENTENCE),
    "framing": ("framing_error", 2 * LINE),
    "wrong_baud": ("framing_error", LINE + SENTENCE),
    "truncated": ("rejected_line", 2 * LINE),
    "missing_field": ("rejected_line", 2 * LINE),
    "out_of_range": ("rejected_line", 2 * LINE),
    "stuck_low": ("framing_error", 0.01),
    "stuck_high": ("went_stale", 0.56),
    "reset": ("went_stale", 0.56),
}


@pytest.mark.parametrize("mode", [0, 2])
@pytest.mark.parametrize("fault", COMPASS_FAULTS)
def test_fault(fault: str, mode: int) -> None:
    # With commands a compass whose line was dead may have been stopped meanwhile.
    dead = mode and fault in ("stuck_low", "stuck_high")
    seconds = 11 if dead else 7.5
    result = run_reader(DATA, seconds=seconds, modes=[(0, mode)], faults=[(BEGIN, END, fault)])
    check_values(result)
    if fault in SIGNS:
        event, within = SIGNS[fault]
        assert BEGIN < min(t for t in result.times(event) if t > BEGIN) <= BEGIN + within
    if fault == "glitches":
        assert len(result.lines) >= 45
    after = [line for line in result.lines if line.time > END and line.is_counts == (mode == 2)]
    assert after[0].time <= END + (3.5 if dead else 2 * LINE)
    assert all(b.time - a.time < LINE + 0.002 for a, b in zip(after, after[1:], strict=False))
    assert result.flags[-1][1] == ({"counts"} if mode == 2 else frozenset())


def test_compass_that_ignores_commands_is_let_alone_for_a_while() -> None:
    result = run_reader(DATA, seconds=26, modes=[(2, 2)], faults=[(1, 19, "ignores_commands")])
    check_values(result)
    failed = result.times("command_timed_out")
    assert len(failed) >= 5 and len(result.times("command_sent")) - 3 <= len(failed) + 1
    # Four attempts, then a pause of four time-outs.
    (paused, _), (over, _) = next(
        pair for pair in zip(result.flags, result.flags[1:], strict=False) if "paused" in pair[0][1]
    )
    assert sum(time < paused for time in failed) == 4
    assert over - paused == pytest.approx(4 * 1.707, abs=0.01)
    # Headings are taken all the while; counts come once it listens.
    assert max(b.time - a.time for a, b in zip(result.lines, result.lines[1:], strict=False)) < 1.5
    assert result.lines[-1].is_counts


def test_faults_by_slot() -> None:
    """The same switches from a file, which a bench of the whole system uses."""
    result = run_reader(
        DATA,
        seconds=5,
        slot_faults=[(3, 5, "out_of_range"), (9, 9, "silence"), (12, 12, "missing_field")],
    )
    check_values(result)
    assert [line.slot for line in result.lines][:15] == [0, 1, 2, 6, 7, 8, 10, 11, *range(13, 20)]


def test_parameters_that_a_bench_of_the_whole_system_sets() -> None:
    text = device_text("hmr3300")
    assert "module hmr3300_device" in text
    for name in ("BIT", "PPM", "LINE", "STARTUP", "ANSWER", "GLITCH", "WRONG_PPM"):
        assert f"parameter integer {name} " in text
