"""Fuzz of the HMR3300's reader, small; and that it would see what it looks for."""

import pytest

import gateware.sensors.hmr3300_sentence as sentence
from sim.devices import hmr3300_fuzz
from sim.devices.hmr3300_fuzz import DIVISOR, GLITCH, fuzz_noise, fuzz_parser, fuzz_pin
from sim.simulators import available

from gateware.serial.uart import Receiver

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


def test_glitches_are_the_longest_that_may_be() -> None:
    assert GLITCH == Receiver(divisor=DIVISOR).spacing - 1


@pytest.mark.parametrize("name, value", [("HEADING_MAX", 3600), ("COUNT_MAX", 32_766),
                                         ("SPACES_MAX", 6), ("WHOLE_MAX", 4), ("DIGITS_MAX", 6)])
def test_finds_a_wrong_limit(name: str, value: int, monkeypatch) -> None:
    monkeypatch.setattr(sentence, name, value)
    assert fuzz_parser(100_000, seed=5).difference.startswith("event ")


def test_finds_glitches_that_are_seen(monkeypatch) -> None:
    monkeypatch.setattr(hmr3300_fuzz, "GLITCH", 3 * GLITCH)
    assert fuzz_pin(3000, seed=5).difference
