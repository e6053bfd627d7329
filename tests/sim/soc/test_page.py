"""The page of the comparison: every figure of the report is on it."""

import pytest

from boresight.sim.soc.page import bars, render_page, timeline

pytestmark = pytest.mark.without_compiler


def row(name: str, scale: int, paper: int | None) -> dict:
    """A row as `sim.soc.comparison.compare_one` makes it."""

    def software(cycles: int, **more) -> dict:
        return {
            "cycles": {"median": cycles},
            "updates": 1000,
            "code_bytes": 20_000 + cycles,
            **more,
        }

    return {
        "estimator": name,
        "log": "a <log>",
        "paper_cycles": paper,
        "float": software(60_000 * scale, apart_deg=1.3e-4),
        "integer": software(14_000 * scale, mismatches=0),
        "hardware": {"cycles": 250 * scale},
        "ratios": {"integer_to_hardware": 56.0, "float_to_hardware": 240.0},
    }


ROWS = [row("complementary", 1, 31_600), row("mekf", 2, None)]
OFFLOAD = {
    "estimator": "mekf",
    "updates": 1000,
    "in_memory": 998,
    "mismatches": 3,
    "sample_to_update_cycles": {"max": 653},
    "update_to_memory_cycles": {"median": 180, "max": 192},
}


def test_page() -> None:
    page = render_page({"software": ROWS, "offload": OFFLOAD})
    for text in (
        "60,000",
        "14,000",
        "250",
        "31,600",
        "120,000",
        "0 of 1,000",
        "1.3e-04",
        "998 of 1,000",
        "3 differ",
        "653",
        "180",
        "192",
        "a &lt;log&gt;",
    ):
        assert text in page, text
    assert "{{" not in page and "{%" not in page
    assert page.count("<svg") == 2 and "http" not in page


def test_without_offload() -> None:
    assert "Offload" not in render_page({"software": ROWS})


def test_plots_show_the_figures() -> None:
    assert "28,000" in bars(ROWS) and "316 µs in the paper" in timeline(ROWS)
    assert bars(ROWS) == bars(ROWS)
