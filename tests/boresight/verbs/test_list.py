"""`boresight list`: what there is, for people and as JSON."""

from __future__ import annotations

import json

from boresight.cli import main
from boresight.model.estimators import ESTIMATORS
from boresight.sim.experiments.registry import EXPERIMENTS
from boresight.verbs.list import list_estimators


def test_names_as_json(capsys):
    assert main(["list", "--json"]) == 0
    names = [e["name"] for e in json.loads(capsys.readouterr().out)["estimators"]]
    assert names == [
        "complementary",
        "complementary_as_printed",
        "ekf_bias",
        "ekf_quaternion",
        "ekf_quaternion_vector",
        "mekf",
        "vqf",
        "registration",
        "satcom",
        "satcom_pointing",
        "mls_attitude",
        "array_phases",
        "array_attitude",
    ]


def test_experiments() -> None:
    shown = list_estimators().experiments
    assert [(e.name, e.summary) for e in shown] == [
        (name, e.summary) for name, e in EXPERIMENTS.items()
    ]


def test_interfaces_are_the_estimators_own() -> None:
    data = list_estimators().to_json()
    assert data["configs"] == [
        {"name": "small", "lanes": 1, "registers": 512},
        {"name": "fast", "lanes": 2, "registers": 512},
        {"name": "small-1024", "lanes": 1, "registers": 1024},
        {"name": "fast-1024", "lanes": 2, "registers": 1024},
    ]
    for shown, e in zip(data["estimators"], ESTIMATORS.values(), strict=True):
        assert shown["summary"] == e.summary
        for key, declared in (("inputs", e.inputs), ("parameters", e.params)):
            assert [(x["name"], x["low"], x["high"], x["unit"]) for x in shown[key]] == [
                (x.name, x.low, x.high, x.unit) for x in declared
            ]
        assert [(p["default"], p["meaning"]) for p in shown["parameters"]] == [
            (p.default, p.meaning) for p in e.params
        ]
        assert [(o["name"], o["unit"]) for o in shown["outputs"]] == [
            (o.name, o.unit) for o in e.outputs
        ]


def test_text(capsys) -> None:
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    heads = [line.partition(":")[0] for line in lines if not line.startswith(" ")]
    assert heads == [*ESTIMATORS, "experiments", "configurations"]
    assert len(lines) == len(heads) + sum(len(e.params) for e in ESTIMATORS.values())
    assert lines[-2] == f"experiments: {', '.join(EXPERIMENTS)}"
    assert lines[-1] == (
        "configurations: small (1 lane, 512 registers), fast (2 lanes, 512 registers), "
        "small-1024 (1 lane, 1,024 registers), fast-1024 (2 lanes, 1,024 registers)"
    )
    row = next(line for line in lines if "kp_pitch_per_s" in line)
    assert row.split(maxsplit=3)[2:] == ["1/s", "[0, 32]"]
