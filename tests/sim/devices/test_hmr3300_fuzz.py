"""Fuzz of the HMR3300's reader, small; and that it would see what it looks for."""

import pytest

from boresight.gateware.sensors import hmr3300_number, hmr3300_sentence
from boresight.sim.rtl.simulators import available
from tests.support.devices.hmr3300_fuzz import fuzz_noise, fuzz_parser, fuzz_pin

pytestmark = pytest.mark.skipif(not available("verilator"), reason="needs Verilator")


@pytest.mark.parametrize(
    "symbols, angle_max",
    [(100_000, 900), (100_000, 600), pytest.param(2_000_000, 900, marks=pytest.mark.soak)],
)
def test_parser(symbols: int, angle_max: int) -> None:
    found = fuzz_parser(symbols, seed=5, angle_max=angle_max)
    assert found.difference == "" and found.symbols == symbols
    assert min(found.events[k] for k in ("heading", "counts", "rejected", "framing")) > 100


@pytest.mark.parametrize("symbols", [10_000, pytest.param(200_000, marks=pytest.mark.soak)])
def test_pin(symbols: int) -> None:
    found = fuzz_pin(symbols, seed=5)
    assert found.difference == "" and found.symbols == symbols
    assert min(found.events[k] for k in ("heading", "counts", "rejected", "framing")) > 20


@pytest.mark.parametrize("cycles", [1_000_000, pytest.param(20_000_000, marks=pytest.mark.soak)])
def test_noise(cycles: int) -> None:
    found = fuzz_noise(cycles, seed=5)
    assert found.difference == "" and found.symbols > 1000


@pytest.mark.parametrize(
    "module, name, value",
    [(hmr3300_number, "HEADING_MAX", 3600), (hmr3300_sentence, "DIGITS_MAX", 6)],
)
def test_finds_a_wrong_limit(module, name: str, value: int, monkeypatch) -> None:
    monkeypatch.setattr(module, name, value)
    assert fuzz_parser(100_000, seed=5).difference.startswith("event ")


def test_finds_glitches_that_are_seen() -> None:
    assert fuzz_pin(3000, seed=5, glitch=9).difference
