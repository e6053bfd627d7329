"""`boresight list`: what there is, for people and as JSON."""

from __future__ import annotations

import json
from importlib import metadata

from boresight.cli import main
from boresight.verbs.list import list_estimators
from tests.support.estimators import ALL

EXPERIMENTS = ["array", "battery", "ekf2", "ins_gnss", "ma2014", "mls", "pmsm", "radar", "satcom"]


def test_names_as_json(capsys):
    assert main(["list", "--json"]) == 0
    names = [e["name"] for e in json.loads(capsys.readouterr().out)["estimators"]]
    assert {"complementary", "mekf", "vqf", "ekf2", "pmsm"} <= set(names)


def test_experiments() -> None:
    shown = list_estimators().experiments
    assert [e.name for e in shown] == EXPERIMENTS
    assert shown[-1].summary.startswith("Satcom on the move: ")


def test_interfaces_are_the_estimators_own() -> None:
    data = list_estimators().to_json()
    assert data["configs"] == [
        {"name": "small", "lanes": 1, "registers": 512},
        {"name": "fast", "lanes": 2, "registers": 512},
        {"name": "small-1024", "lanes": 1, "registers": 1024},
        {"name": "fast-1024", "lanes": 2, "registers": 1024},
        {"name": "small-2048", "lanes": 1, "registers": 2048},
        {"name": "fast-2048", "lanes": 2, "registers": 2048},
    ]
    for shown, e in zip(data["estimators"], ALL.values(), strict=True):
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
    assert heads == [*ALL, "experiments", "configurations"]
    assert len(lines) == len(heads) + sum(len(e.params) for e in ALL.values())
    assert lines[-2] == f"experiments: {', '.join(EXPERIMENTS)}"
    assert lines[-1] == (
        "configurations: small (1 lane, 512 registers), fast (2 lanes, 512 registers), "
        "small-1024 (1 lane, 1,024 registers), fast-1024 (2 lanes, 1,024 registers), "
        "small-2048 (1 lane, 2,048 registers), fast-2048 (2 lanes, 2,048 registers)"
    )
    row = next(line for line in lines if "kp_pitch_per_s" in line)
    assert row.split(maxsplit=3)[2:] == ["1/s", "[0, 32]"]


def test_an_entry_point_that_cannot_be_loaded_is_said_and_the_others_are_listed(
    monkeypatch, capsys
) -> None:
    point = metadata.EntryPoint("gone", "no_such_package:Gone", "boresight.experiments")
    monkeypatch.setattr(
        metadata, "entry_points", lambda group: [point] if group == point.group else []
    )
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].startswith("experiment gone: wanted an entry point that imports (no_such_pack")
    assert list_estimators().to_json()["unusable"] == lines[-1:]
