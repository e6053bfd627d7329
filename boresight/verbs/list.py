"""`boresight list`: the estimators, their interfaces, the experiments, the configurations."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from typing import Any

from boresight.gateware.machine import ALL_CONFIGS
from boresight.model.estimators import ESTIMATORS
from boresight.options import Outcome
from boresight.sim.experiments.registry import EXPERIMENTS

__all__ = ["add_arguments", "call", "list_estimators"]


def list_estimators() -> dict[str, Any]:
    """Estimators with their inputs, parameters and outputs, experiments, configurations."""
    return {
        "estimators": [
            {
                "name": e.name,
                "summary": e.summary,
                "inputs": [
                    {"name": i.name, "unit": i.unit, "low": i.low, "high": i.high} for i in e.inputs
                ],
                "parameters": [
                    {
                        "name": p.name,
                        "default": p.default,
                        "low": p.low,
                        "high": p.high,
                        "unit": p.unit,
                        "meaning": p.meaning,
                    }
                    for p in e.params
                ],
                "outputs": [{"name": o.name, "unit": o.unit} for o in e.outputs],
            }
            for e in ESTIMATORS.values()
        ],
        "experiments": [{"name": e.name, "summary": e.summary} for e in EXPERIMENTS.values()],
        "configs": [
            {"name": m.name, "lanes": m.lanes, "registers": m.register_words}
            for m in ALL_CONFIGS.values()
        ],
    }


def add_arguments(parser: ArgumentParser) -> None:
    """What the command line takes."""


def call(args: Namespace) -> Outcome:
    """Do it; see `Outcome`."""
    data = list_estimators()
    lines = []
    for e in data["estimators"]:
        lines.append(f"{e['name']}: {e['summary']}")
        lines += [
            f"    {p['name']:20s} {p['default']:<10g} {p['unit']:12s} [{p['low']:g}, {p['high']:g}]"
            for p in e["parameters"]
        ]
    lines.append(f"experiments: {', '.join(EXPERIMENTS)}")
    lines.append(
        "configurations: "
        + ", ".join(
            f"{c['name']} ({c['lanes']} lane{'s' if c['lanes'] > 1 else ''}, "
            f"{c['registers']:,} registers)"
            for c in data["configs"]
        )
    )
    return 0, data, "\n".join(lines)
