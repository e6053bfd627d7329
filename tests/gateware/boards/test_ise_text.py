"""README.txt of a made-up design; test_ise.py reads those of real ones and runs the scripts."""

import re
from types import SimpleNamespace

import pytest

from boresight.gateware.boards.board import BOARDS, Line
from boresight.gateware.boards.ise_text import BUILD_BAT, BUILD_SH, readme, table

PINS = {"clk50_0__io": "P134", "rx_0__io": "P34", "led_1__io": "P30"}


def text_of(clock_hz: int) -> str:
    design = SimpleNamespace(
        title="A design",
        clock_hz=clock_hz,
        lines=(
            Line("rx", "host_rx", "from the host", input=True),
            Line("alive", "led1", "it lives"),
        ),
        text=lambda: ("HEAD OF IT\n", "END OF IT\n"),
    )
    return readme(
        design=design, board=BOARDS["sk-xc6slx9"], part="the part", pins=PINS,
        oscillator_hz=50_000_000,
    )  # fmt: skip


def test_a_row_for_every_pin() -> None:
    text = text_of(50_000_000)
    assert text.startswith("A design on SK-XC6SLX9\n======================\n\nHEAD OF IT\n")
    assert text.endswith("\nEND OF IT\n")
    rows = [re.split(r"  +", line.strip()) for line in text.splitlines() if " P" in line]
    assert [row for row in rows if len(row) == 4] == [
        ["clock", "P134", "on the board", "oscillator, 50 MHz"],
        ["rx", "P34", "x_7 position 3", "from the host"],
        ["alive", "P30", "x_7 position 7", "it lives"],
    ]


@pytest.mark.parametrize(
    ("clock_hz", "clock", "derived"),
    [
        (50_000_000, "50 MHz, the board's oscillator", False),
        (62_500_000, "62.5 MHz, by PLL from the board's 50 MHz", True),
    ],
)
def test_the_clock_and_what_it_comes_from(clock_hz: int, clock: str, derived: bool) -> None:
    text = text_of(clock_hz)
    assert f"Clock    {clock}\n" in text
    assert ("from which ISE derives 62.5 MHz behind the PLL;" in text) == derived


def test_tables_stand_in_columns() -> None:
    assert table([("a", "bcd", "e"), ("fgh", "", "ij")]) == "  a    bcd  e\n  fgh       ij"
    assert table([("a", "bc"), ("d", "")]) == "  a  bc\n  d"


def test_scripts_ask_for_the_same_tools() -> None:
    tools = "xst ngdbuild map par bitgen trce"
    assert f"for tool in {tools}; do" in BUILD_SH
    assert f"in ({tools}) do" in BUILD_BAT
    assert re.findall("trce -v.*top.twr", BUILD_SH) == re.findall("trce -v.*top.twr", BUILD_BAT)
