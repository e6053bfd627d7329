"""Cells are scored as the protocol scores its runs."""

from __future__ import annotations

import pytest

from boresight.model.errors import InputError
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.attitude.robustness import cells as module
from boresight.sim.attitude.robustness.cells import cells
from boresight.sim.attitude.robustness.logs import carrier
from boresight.sim.attitude.robustness.plan import cases_of
from boresight.sim.attitude.robustness.runs import figures_of, prepared
from boresight.sim.rotations.outputs import attitude_of


def test_figures_are_those_of_the_protocol(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = [c for c in cases_of("short") if c.name in ("as recorded", "never a field")]
    monkeypatch.setattr(module, "cases_of", lambda protocol: wanted)
    log, complementary = carrier("ship", 1, seconds=20.0), estimator_of("complementary")
    held = cells(complementary, [log.record()], "short")
    assert [(c.log, c.case) for c in held] == [(log.name, case) for case in wanted]
    cases = [(c.case.group, c.case.judged) for c in held]
    scorer = Scorer(complementary, [c.given for c in held], jobs=1, scored=cases)
    runs = scorer.each(lambda k, level: level.run_anew(held[k].given.inputs))
    figures = [
        figures_of(prepared(case, log), attitude_of(run.outputs))
        for case, run in zip(wanted, runs, strict=True)
    ]
    assert scorer.scores() == [
        {"as recorded": pytest.approx(figures[0]["total"])},
        {"never a field": pytest.approx(figures[1]["inclination"])},
    ]
    assert figures[0]["total"] != pytest.approx(figures[0]["inclination"])


def test_cases_of_a_full_scale_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = [c for c in cases_of("full") if c.name in ("as recorded", "fast turns")]
    monkeypatch.setattr(module, "cases_of", lambda protocol: wanted)
    held = cells(estimator_of("complementary"), [carrier("ship", 1, seconds=9.0).record()], "full")
    assert [c.case.name for c in held] == ["as recorded"]


def test_an_estimator_without_attitude_is_refused() -> None:
    with pytest.raises(InputError, match="outputs are an attitude"):
        cells(estimator_of("registration"), [], "short")
