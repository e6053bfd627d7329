"""`sim.report.schedule`: the chart's data are the schedule's."""

from boresight.gateware.core import Core
from boresight.sim.report.schedule import KINDS, schedule_section


def test_units_add_up(core: Core) -> None:
    s = schedule_section(core)
    for lane in s["lanes"]:
        units = [u for u in s["units"] if u["unit"] == f"lane {lane['lane']}"]
        assert sum(u["busy_cycles"] for u in units) == lane["busy_cycles"] <= s["cycles"]
        assert {u["op"] for u in units} <= set(KINDS)
    assert sum(x["busy_cycles"] for x in s["lanes"]) == s["slots_total"]
    assert sum(x["results"] for x in s["lanes"]) == s["ops_total"] + s["copies"]
    terms = sum(len(op.terms) for op in core.schedule.program.ops)
    kinds = {
        k: sum(u["count"] for u in s["units"] if u["op"] == k and u["unit"] != "output")
        for k in KINDS
    }
    assert kinds["multiply-add"] + kinds["function table"] == terms
    # A slot may send its operand and multiply it too.
    assert kinds["emit"] <= len(core.program.outputs)
    by_unit = {u["unit"]: u for u in s["units"]}
    assert by_unit["input"]["count"] == len(core.program.inputs)
    assert all(u["utilisation"] == round(u["busy_cycles"] / s["cycles"], 4) for u in s["units"])


def test_chart_names_what_happens(small_core: Core) -> None:
    chart = schedule_section(small_core)["chart"]
    program = small_core.schedule.program
    assert len({(c, lane) for c, lane, *_ in chart["slots"]}) == len(chart["slots"])
    assert [name for _, name in chart["gets"]] == [program.values[n].name for n in program.inputs]
    assert sorted(name for _, name, _ in chart["outputs"]) == sorted(program.output_names)
    assert {name: c for _, name, c in chart["outputs"]} == dict(
        zip(program.output_names, small_core.schedule.latencies, strict=True)
    )
    sent = [label.rsplit("emit ", 1)[1] for *_, label, _ in chart["slots"] if "emit " in label]
    assert sorted(sent) == sorted(program.output_names)
    by_kind = {kind: label for _, _, kind, label, _ in chart["slots"]}
    assert set(by_kind) - {"emit"} == set(KINDS) - {"emit"}
    assert ": capture " in by_kind["capture"]
    assert "[table " in by_kind["function table"] and ": term " in by_kind["multiply-add"]
