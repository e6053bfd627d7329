"""Where lines meet the boards; test_ise.py compares the pins of whole projects."""

import pytest

from boresight.gateware.boards.board import BOARDS, Board, Line

IN = Line("rx", "host_rx", "from the host", input=True, pull_up=True)
OUT = Line("tx", "host_tx", "to the host")
LED = Line("alive", "led1", "it lives")


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_resources(board: Board) -> None:
    platform = board.make([IN, OUT, LED])
    found = {}
    for line in (IN, OUT):
        (pins,) = platform.lookup(line.name).ios
        found[line.name] = (pins.dir, platform.lookup(line.name).attrs)
        mapping = platform.connectors[board.connector].mapping
        assert pins.map_names(platform._conn_pins, pins) == [mapping[board.positions[line.place]]]
    assert found["rx"] == ("i", {"IOSTANDARD": "LVCMOS33", "PULLUP": "TRUE"})
    assert found["tx"] == ("o", {"IOSTANDARD": "LVCMOS33", "SLEW": "SLOW", "DRIVE": "8"})
    assert ("alive", 0) not in platform.resources
    assert platform.lookup("led", 1)  # the board's own, or on its connector
    assert platform.lookup(platform.default_clk).clock.frequency == board.oscillator_hz


@pytest.mark.parametrize("board", BOARDS.values(), ids=BOARDS)
def test_every_line_has_a_position_of_its_own(board: Board) -> None:
    used = [*board.positions.values(), *board.leds]
    assert len(set(used)) == len(used)
    assert board.positions.keys() == BOARDS["mimas"].positions.keys()


def test_places_for_people() -> None:
    mimas, sk = BOARDS["mimas"], BOARDS["sk-xc6slx9"]
    assert [board.positions["adis_cs_n"] for board in (mimas, sk)] == ["5", "8"]
    assert (mimas.header, sk.header) == ("p_1", "x_7")
    assert [mimas.where(line) for line in (IN, LED)] == ["p_1 position 3", "on the board"]
    assert [sk.where(line) for line in (OUT, LED)] == ["x_7 position 5", "x_7 position 7"]
