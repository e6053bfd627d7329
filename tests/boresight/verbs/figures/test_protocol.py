"""`boresight accuracy --protocol` from the front: files, exit code, what it runs on by default."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError
from boresight.sim.attitude.robustness import logs as carriers
from boresight.sim.attitude.robustness import runs
from boresight.sim.attitude.robustness.plan import Case, cases_of
from boresight.verbs.figures.protocol import accuracy_protocol, own_trials


@pytest.fixture
def one_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """One case of a trial of some seconds."""
    known, whole = cases_of("short")[0], carriers.carrier

    def cases(protocol: str) -> list[Case]:
        return [known] if protocol == "short" else cases_of(protocol)

    for module in ("boresight.verbs.figures.protocol", "boresight.sim.attitude.robustness.runs"):
        monkeypatch.setattr(f"{module}.cases_of", cases)
    monkeypatch.setattr("boresight.verbs.figures.protocol.own_trials", lambda: ["carrier:ship:1"])
    monkeypatch.setattr(carriers, "carrier", lambda name, seed: whole(name, seed, seconds=8.0))
    runs.log_with_digest.cache_clear()
    yield
    runs.log_with_digest.cache_clear()


@pytest.mark.usefixtures("one_case")
def test_files_and_figures(tmp_path: Path) -> None:
    result = accuracy_protocol("short", "complementary,vqf_online", jobs=1, output=tmp_path)
    assert result.good and result.trials == ("ship-1",) and result.rival == "vqf_online"
    assert result.page == tmp_path / "accuracy-short.html"
    data = result.to_json()
    assert data["file"] == str(result.page)
    saved = json.loads((tmp_path / "accuracy-short.json").read_text())
    assert saved["groups"] == data["groups"] and len(saved["groups"]) == 1
    assert [w["estimator"] for w in saved["worse"]] == ["complementary"] and saved["worse"][0]["of"]
    assert "complementary" in (tmp_path / "accuracy-short.html").read_text()


def test_what_it_runs_on_by_default() -> None:
    names = [runs.name_of(trial) for trial in own_trials()]
    assert names[0] == "synthetic_60s" and "ximu_walk" not in names
    assert {"car-1", "drone-2", "pedestrian-1", "ship-2"} <= set(names)


def test_objects_and_unknown_protocols_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="other processes can read"):
        accuracy_protocol("short", Complementary, output=tmp_path)
    with pytest.raises(InputError, match="wanted one of full, short, glance"):
        accuracy_protocol("long", "mekf", output=tmp_path)
