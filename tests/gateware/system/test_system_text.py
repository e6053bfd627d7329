"""What README.txt says of a system: its own figures, a row for each estimator."""

import re
from types import SimpleNamespace
from typing import Any

from boresight.gateware.system.system_text import system_text

PLAN: Any = SimpleNamespace(
    filters=2, word=28, names=("one", "two", "calibrate_inertial", "calibrate_field")
)
MACHINE: Any = SimpleNamespace(name="fast", lanes=2)


def test_its_own_figures() -> None:
    head, body = system_text(
        PLAN, MACHINE, build=0xAB, baud=921_600.0, clock_hz=50e6, latency_cycles=[29_000, 29_101]
    )
    assert "2 filter(s)" in head and "configuration fast, 2 lane(s), 28-bit words\n" in head
    assert "Build    00000000000000ab (" in head and "Host     921600 baud, " in head
    rows = [re.split(r"  +", line.strip()) for line in body.splitlines() if re.match(r"  \d", line)]
    assert rows == [["0", "one", "29000", "580.00"], ["1", "two", "29101", "582.02"]]
    assert "{" not in head + body and "calibrate_inertial" not in body
