"""`boresight calibrate`: its designs, and its text, from routed designs that are given."""

from types import SimpleNamespace

import pytest

from boresight.gateware.machine import machine_named
from boresight.gateware.synthesis.calibration import Estimated
from boresight.model.resolve import estimator_of
from boresight.verbs.figures import calibrate as module


def test_designs_can_be_built() -> None:
    assert len(module._DESIGNS) == len(set(module._DESIGNS)) >= 12
    for names, config, word in module._DESIGNS:
        for name in names:
            estimator_of(name).compile(word=word)
        machine_named(config)


def test_text(monkeypatch: pytest.MonkeyPatch) -> None:
    said = []

    def route(core, target, *, seeds, progress):
        progress("seed 1")
        return SimpleNamespace(source=f"{target.title}, {seeds} seeds")

    def estimated(routed, top):
        errors = ({"median": 0.5, "p75": -0.25}, {"median": -0.1, "p75": -0.4})
        return [
            Estimated(name, [100.0, 96.0], {"median": 144.0, "p75": 72.0}, error)
            for name, error in zip(routed, errors, strict=True)
        ]

    monkeypatch.setattr(module, "check_routable", lambda *_: None)
    monkeypatch.setattr(module, "Build", lambda *_, **options: SimpleNamespace(core=options))
    monkeypatch.setattr(module, "route_core", route)
    monkeypatch.setattr(module, "estimated", estimated)
    result = module.calibrate(seeds=2, designs=2, progress=said.append)
    assert said == [
        "complementary, small-d9, W = 18: seed 1",
        "complementary, small, W = 32: seed 1",
    ]
    _, first, _, median, slow, source = str(result).splitlines()
    assert " ".join(first.split()) == (
        "complementary, small-d9, W = 18 96.0 to 100.0 144.0 +50 % 72.0 -25 %"
    )
    assert median == "median nets: -10 % to +50 % of the slowest seed"
    assert slow == "p75 nets: -40 % to -25 % of the slowest seed"
    assert source == "ecp5-25k, speed 6, 2 seeds"
    assert result.band("median") == (-0.1, 0.5)
