"""`boresight simulate`: figures, page, and what it refuses."""

import importlib
import json

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.gateware.system.programs import system_core
from boresight.sim.records.bundled import bundled

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.simulate")


@pytest.fixture
def small(monkeypatch) -> None:
    """The board that the demo's test builds too: its simulation stands in the build cache."""
    filters = ("complementary", "complementary_as_printed")
    monkeypatch.setattr(module, "FILTERS", filters)
    monkeypatch.setattr(
        module,
        "system_core",
        lambda filters, config: system_core(filters, config=config, restarts=1),
    )


def test_figures_and_page(small, tmp_path) -> None:
    data = boresight.simulate("complementary", seconds=0.05, output=tmp_path)
    assert data.good
    assert json.loads(json.dumps(data.to_json())) == json.loads(
        (tmp_path / "board.json").read_text()
    )
    row = data.runs[0]
    assert row.updates == row.frames == 51
    assert row.mismatches == row.lost_samples == row.timing_violations == 0
    assert row.beside_program_us <= 1.0
    assert row.in_registers_us == row.predicted_us
    page = (tmp_path / "board.html").read_text()
    assert "complementary" in page and "<svg" in page and "http" not in page
    assert "51" in str(data)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["kalman"], "error: estimator: wanted one of array_attitude, "),
        (["mekf", "--source", "gps"], "error: source: wanted one of counts, heading, found 'gps'"),
        (["mekf", "--seconds", "0"], "error: seconds: wanted 0.05 to 20, found 0"),
        (["mekf", "--seconds", "nan"], "error: seconds: wanted 0.05 to 20, found nan"),
        (
            ["mekf", str(bundled("ximu_walk")), "--seconds", "13"],
            "error: log 'ximu_walk': wanted 13312 rows or more, found 12625; give a longer log",
        ),
    ],
)
def test_refused(arguments, message, capsys, tmp_path) -> None:
    assert main(["simulate", *arguments, "-o", str(tmp_path / "new")]) == 2
    err = capsys.readouterr().err
    assert err.startswith(message) and err.count("\n") == 1
    assert not (tmp_path / "new").exists()


def test_data_in_memory_is_read() -> None:
    columns = {"t": np.arange(9.0), "gx": np.zeros(9)}
    with pytest.raises(boresight.InputError, match=r"^log 'record': wanted 51 rows or more, found"):
        boresight.simulate("mekf", columns, seconds=0.05)


def test_unknown_fault_is_refused() -> None:
    with pytest.raises(boresight.InputError, match="found 'adis.gremlins'"):
        boresight.simulate_faults("mekf", faults=["adis.gremlins"])
