"""What README.txt says of a system: its own figures, a row for each estimator."""

import re
from types import SimpleNamespace
from typing import Any

from boresight.gateware.system.system_text import system_text

SYSTEM: Any = SimpleNamespace(
    plan=SimpleNamespace(
        filters=2, word=28, names=("one", "two", "calibrate_inertial", "calibrate_field")
    ),
    core=SimpleNamespace(machine=SimpleNamespace(name="fast", lanes=2)),
    build=0xAB,
    host_baud=921_600.0,
    clock_hz=50e6,
    latency_cycles=lambda number: 29_000 + 101 * number,
)


def test_its_own_figures() -> None:
    head, body = system_text(SYSTEM)
    assert "2 filter(s)" in head and "configuration fast, 2 lane(s), 28-bit words\n" in head
    assert "Build    00000000000000ab (" in head and "Host     921600 baud, " in head
    rows = [re.split(r"  +", line.strip()) for line in body.splitlines() if re.match(r"  \d", line)]
    assert rows == [["0", "one", "29000", "580.00"], ["1", "two", "29101", "582.02"]]
    assert "{" not in head + body and "calibrate_inertial" not in body
