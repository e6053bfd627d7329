"""Area and clock: words of 18 bits take one multiplier block; estimated, or routed."""

from types import SimpleNamespace

from boresight.sim.explore.cases import Planned, planned
from boresight.sim.explore.figures import explored
from boresight.sim.explore.measure import Case, Exploration, Task, measured
from tests.support.smooth import LOG, Smooth


def test_area_of_18_bits() -> None:
    (row,) = measured(
        Exploration((LOG,)), [Task("k", "area", Case(Smooth, (), 18, "small", "xc6slx9"))]
    )
    assert row["dsp"] == 1 and row["fits"] is True
    assert 200 < row["lut"] < 400 and row["clock"] > 50.0


def test_a_tool_that_fails_is_worth_another_try(monkeypatch) -> None:
    from boresight.gateware.synthesis.yosys import SynthesisError

    def fail(*_, **__):
        raise SynthesisError("no memory\nmore")

    monkeypatch.setattr("boresight.sim.explore.measure.netlist_for", fail)
    case = Case(Smooth, (), 18, "small", "xc6slx9")
    (row,) = measured(Exploration((LOG,)), [Task("k", "area", case)])
    assert row == {"refused": "no memory", "again": True}


def test_area_and_routed_clock_of_an_ecp5(monkeypatch) -> None:
    case = Case(Smooth, (), 18, "small", "ecp5-25k")
    (area,) = measured(Exploration((LOG,)), [Task("k", "area", case)])
    assert area["dsp"] == 1 and area["ram"] >= 2 and "clock" not in area

    seen = []

    def implement(verilog, top, target, *, seeds, cache_dir):
        seen.append((top, target.name, seeds, "MULT18X18D" in verilog))
        return SimpleNamespace(clock_mhz=50.0)

    monkeypatch.setattr("boresight.sim.explore.measure.implement", implement)
    (routed,) = measured(Exploration((LOG,), seeds=3), [Task("r", "routed", case)])
    assert seen == [("core", "ecp5-25k", 3, False)]
    rows = {"k": area, "r": routed, "c": {"cycles": 10, "interval": 12}}
    plan = Planned(case, {"cycles": "c", "area": "k", "routed": "r"})
    row = explored(plan, rows, Exploration((LOG,), seeds=3), clock_mhz=100.0)
    assert (row.clock, row.clock_is, row.us, row.own_us) == (50.0, "routed", 0.1, 0.2)
    assert row.figures["own_us"] == 0.2


def test_routers_serve_targets_that_have_one(monkeypatch) -> None:
    monkeypatch.setattr(
        "boresight.sim.explore.cases.find_router", lambda router: SimpleNamespace(version="r 1")
    )
    cases = [Case(Smooth, (), 18, "small", target) for target in ("xc6slx9", "ecp5-25k")]
    before = None
    for seeds in (1, 2):
        plans, tasks = planned(
            Exploration((LOG,), seeds=seeds), cases, [LOG], area=False, route=True
        )
        assert [task.kind for task in tasks.values()] == ["errors", "cycles", "routed"]
        assert "routed" not in plans[0].keys and plans[1].keys["routed"] != before
        before = plans[1].keys["routed"]


def test_toggles_of_the_last_updates_in_families_whose_netlist_is_simulated(monkeypatch) -> None:
    seen = []

    class Simulation:
        def __init__(self, core, trace):
            assert trace and core.machine.arithmetic.word == 18

        def toggles(self, words, first, stop):
            seen.append((words.tolist(), first, stop))
            return 12.5

    monkeypatch.setattr("boresight.sim.explore.measure.NetlistSimulation", Simulation)
    cases = [Case(Smooth, (), 18, "small", target) for target in ("xc6slx9", "ecp5-25k")]
    plans, tasks = planned(Exploration((LOG,)), cases, [LOG], area=False, toggles=True)
    assert "toggles" in plans[0].keys and "toggles" not in plans[1].keys
    counted = [task for task in tasks.values() if task.kind == "toggles"]
    found = measured(Exploration((LOG,)), counted)
    rows = {task.key: row for task, row in zip(counted, found, strict=True)}
    assert explored(plans[0], rows, Exploration((LOG,)), clock_mhz=1.0).figures["toggles"] == 12.5
    ((words, first, stop),) = seen
    assert len(words) == stop == len(LOG) and first == stop - 1
