"""`boresight list`: the estimators, their interfaces, the configurations."""

from __future__ import annotations

from typing import Any

from boresight.gateware.machine import CONFIGS
from boresight.model.estimators import ESTIMATORS

__all__ = ["list_estimators"]


def list_estimators() -> dict[str, Any]:
    """Estimators with their inputs, parameters and outputs, and the configurations."""
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
        "configs": [{"name": m.name, "lanes": m.lanes} for m in CONFIGS.values()],
    }
