"""Fuzz of the HMR3300's reader, small; and that it would see what it looks for."""

import pytest

from boresight.gateware.sensors import hmr3300_number, hmr3300_sentence
from boresight.sim.simulators import available
from tests.support.devices.hmr3300_fuzz import fuzz_noise, fuzz_parser, fuzz_pin

pytestmark = pytest.mark.skipif(not available("verilator"), reason="needs Verilator")


@pytest.mark.parametrize("angle_max", [900, 600])
def test_parser(angle_max: int) -> None:
    found = fuzz_parser(100_000, seed=5, angle_max=angle_max)
    assert found.difference == "" and found.symbols == 100_000
    assert min(found.events[k] for k in ("heading", "counts", "rejected", "framing")) > 100


def test_pin() -> None:
    found = fuzz_pin(10_000, seed=5)
    assert found.difference == "" and found.symbols == 10_000
    assert min(found.events[k] for k in ("heading", "counts", "rejected", "framing")) > 20


def test_noise() -> None:
    found = fuzz_noise(1_000_000, seed=5)
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
