"""``records.h``: what the firmware is told of the estimators' records, number by number."""

from __future__ import annotations

import re
from typing import Any

import pytest

from boresight.gateware.core import build_core
from boresight.gateware.description import Records, describe
from boresight.gateware.texts.records import records_header
from boresight.model.estimator import Estimator, Input, Output
from boresight.model.estimators.complementary import Complementary


class Still(Estimator):
    """No time step, a field whose first axis comes last, outputs of every kind."""

    inputs = (
        Input("my", -256.0, 255.9, "uT", missing=0.0),
        Input("ax", -160.0, 160.0, "m/s^2"),
        Input("mx", -256.0, 255.9, "uT", missing=0.0),
    )
    outputs = (Output("sum", "m/s^2"), Output("half", "ht"), Output("bits", "flags"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"sum": u.ax + u.my, "half": u.mx * (1 / 512), "bits": u.ax * 0.5}


@pytest.fixture(scope="module")
def programs() -> list[Records]:
    compiled = [Complementary().compile(), Still().compile()]
    return [describe(build_core(p, "small", restarts=0)).programs[0] for p in compiled]


@pytest.fixture(scope="module")
def text(programs: list[Records]) -> str:
    return records_header(programs, outputs=0x10, inputs=0x20)


def rows(text: str, name: str) -> list[list[str]]:
    """Rows of a table; of a plain one, one row."""
    found = re.search(rf"{name}(?:\[\d+\])+ = \{{(.*)\}};", text)
    assert found
    inner = re.findall(r"\{([^{}]*)\}", found[1]) or [found[1]]
    return [row.split(", ") for row in inner]


def test_sizes_are_those_of_the_longest(text: str) -> None:
    for line in ("RECORD_INPUTS 10u", "RECORD_OUTPUTS 8u", "RECORD_INPUT_ADDR 32u",
                 "RECORD_OUTPUT_ADDR 16u"):  # fmt: skip
        assert f"#define {line}" in text
    assert rows(text, "record_inputs") == [["10", "3"]]
    assert rows(text, "record_outputs") == [["8", "3"]]
    assert "of the estimators complementary, still, by" in text


def test_the_time_step_and_the_field_by_name(text: str) -> None:
    assert rows(text, "record_step") == [["0", "-1"]]
    assert rows(text, "record_field") == [[f"UINT32_C({0b111 << 4})", f"UINT32_C({0b101})"]]


def test_binary_points_are_the_programs(programs: list[Records], text: str) -> None:
    for name, which in (("record_in_frac", "inputs"), ("record_out_frac", "outputs")):
        wanted = [[str(w.frac) for w in getattr(p, which)] for p in programs]
        assert rows(text, name) == wanted


def test_a_line_says_of_an_attitude_its_angles_and_of_others_all(text: str) -> None:
    """Heading, pitch, roll, status; angles, bits and numbers each in their way."""
    assert rows(text, "record_said") == [["4", "3"]]
    assert rows(text, "record_place") == [["2", "0", "1", "7"], ["0", "1", "2"]]
    assert rows(text, "record_kind") == [["0u", "0u", "0u", "1u"], ["2u", "0u", "1u"]]
