"""The reader against a device that does whatever it likes; and that the judge is not blind."""

from collections.abc import Callable

import pytest

from boresight.gateware.attitude.sensors.adis16385_flags import EVENTS
from boresight.gateware.verilog import to_verilog
from tests.support.attitude.devices.adis16385_bench import scaled_reader
from tests.support.attitude.devices.adis16385_contract import Contract, ContractBroken
from tests.support.attitude.devices.adis16385_fuzz import fuzz, judge


@pytest.mark.parametrize(
    "frames, seed", [(8_000, 1), pytest.param(1_000_000, 2, marks=pytest.mark.soak)]
)
def test_reader_keeps_its_contract(frames: int, seed: int) -> None:
    result = fuzz(frames, seed=seed)
    assert result.frames == frames
    # Nothing was left out.
    assert set(result.events) == set(EVENTS)
    assert min(result.events.values()) >= 10


#: A start, a sample, written by hand: half period 3, stall 30 (so a frame is 130 cycles).
def trace() -> list[str]:
    lines = ["2050 r 1"]
    answers = [0, 0x4001, 0x4001, 0, 0, 0, 0, 0, 0, 0x4001, 6, 1, 0x402]
    sent = [
        0x5600,
        0x5600,
        0xB406,
        0xB500,
        0xB601,
        0xB700,
        0xB802,
        0xB904,
        0x5600,
        0x3400,
        0x3600,
        0x3800,
        0x1000,
    ]
    falls = 6146
    for word, answer in zip(sent, answers, strict=True):
        lines += [f"{falls} c", f"{falls + 99} f {word:04x} {answer:04x}"]
        falls += 130
    running = falls - 130 + 99 + 2
    lines += [f"{running} F 01", f"{running + 200} d"]
    falls = running + 204
    burst = [
        (0x0400, 0x8FFF),
        (0x0600, 1),
        (0x0800, 2),
        (0x0A00, 3),
        (0x0C00, 4),
        (0x0E00, 5),
        (0x3C00, 6),
        (0x5600, 0),
        (0x1000, 0x4001),
    ]
    for word, answer in burst:
        lines += [f"{falls} c", f"{falls + 99} f {word:04x} {answer:04x}"]
        falls += 130
    sample = falls - 130 + 99 + 2
    lines += [
        f"{sample} E 001",
        f"{sample} S {running + 202} 0 0001 0002 0003 0004 0005 0006 ffff 0000",
    ]
    late = sample + 5000
    lines += [f"{late} d", f"{late + 4} c", f"{late + 50} d", f"{late + 53} E 080"]
    return lines


@pytest.fixture(scope="module")
def judged() -> Callable[[list[str]], dict[str, int]]:
    reader = scaled_reader()
    to_verilog(reader, "adis16385", instances=False)  # a component that is not built is a warning
    return lambda lines: judge(lines, Contract(reader, (6, 1, 0x402)))


def test_judge_takes_what_is_right(judged) -> None:
    lines = trace()
    assert judged(lines) == {"sample": 1, "overrun": 1}


@pytest.mark.parametrize(
    "old, new",
    [
        ("E 001", "E 000"),
        ("E 001", "E 041"),
        ("F 01", "F 03"),
        (" 0 0001", " 1 0001"),
        ("0004 0005", "0004 0007"),
        ("ffff", "0fff"),
        ("f 3400 4001", "f 3400 4000"),
        ("f b601 ", "f b602 "),
        ("f 1000 4001", "f 1000 4003"),
        ("E 080", "E 001"),
        ("2050 r", "1000 r"),
    ],
)
def test_judge_sees_what_is_wrong(judged, old: str, new: str) -> None:
    lines = trace()
    changed = [line.replace(old, new) for line in lines]
    assert changed != lines
    with pytest.raises(ContractBroken, match=r"^\d+: "):
        judged(changed)


def test_judge_sees_a_hang(judged) -> None:
    lines = [line for line in trace() if not line.endswith(" d")]
    with pytest.raises(ContractBroken, match=r"hung in state edge$"):
        judged([*lines[:28], "9999999 d"])


def test_judge_sees_broken_timing(judged) -> None:
    with pytest.raises(ContractBroken, match=r"^violation: half 2$"):
        judged(["violation: half 2"])
