"""`sim.report.accuracy` against direct computation."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model.errors import InputError
from boresight.sim.attitude.accuracy import attitude_rmse
from boresight.sim.attitude.outputs import attitude_of, euler_deg_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Column, Record
from boresight.sim.report.accuracy import ANGLES, BINS, Replay, accuracy_section


def section(core: Core, *replays: Replay) -> tuple[dict, list[str]]:
    warnings: list[str] = []
    return accuracy_section(core.program, replays, warnings.append), warnings


def test_figures(core: Core, replay: Replay) -> None:
    found, warnings = section(core, replay)
    assert warnings == []
    assert replay.reference is not None
    apart = np.abs(euler_deg_of(replay.fixed) - euler_deg_of(replay.reference))
    apart = np.minimum(apart, 360.0 - apart).max(axis=1)
    assert found["vs_float_max_deg"] == pytest.approx(apart.max(), rel=1e-5)
    assert found["vs_float_max_sample"] == int(apart.argmax())
    assert found["vs_float_until_80_deg"] == found["vs_float_max_deg"] > 0
    rmse = attitude_rmse(attitude_of(replay.fixed), NineAxis.of(replay.log).attitude[: len(replay)])
    assert found["rmse_deg"] == pytest.approx(rmse._asdict(), rel=1e-5)
    assert found["float_rmse_deg"]["total"] == pytest.approx(rmse.total, rel=1e-4)
    assert (found["dataset"], found["samples"]) == ("synthetic_60s", len(replay))
    assert found["reference"] == "truth"
    only, _ = section(core, dataclasses.replace(replay, truth=False))
    assert only["reference"] == "comparison"


def test_curves(core: Core, replay: Replay) -> None:
    series = section(core, replay)[0]["logs"][0]["series"]
    assert series["samples_per_point"] == 1
    for k, name in enumerate(ANGLES):
        np.testing.assert_allclose(
            series["fixed_deg"][name], euler_deg_of(replay.fixed)[:, k], rtol=1e-4, atol=1e-4
        )
    # The truth has the angles in the same order as the outputs.
    last = [series["log_deg"][name][-1] - series["fixed_deg"][name][-1] for name in ANGLES]
    assert np.abs(last).max() < 6.0


def test_long_logs_are_binned_without_losing_peaks(core: Core, replay: Replay) -> None:
    n = 4999
    fixed = {name: np.resize(x, n) for name, x in replay.fixed.items()}
    reference = {name: x.copy() for name, x in fixed.items()}
    reference["roll"][1234] += 0.25
    log = Record(replay.log.name, {"t": Column(np.arange(n) * 0.01)})
    found, warnings = section(core, Replay(log, fixed, reference))
    assert warnings == ["accuracy: synthetic_60s has no attitude to compare with"]
    series = found["logs"][0]["series"]
    assert len(series["t_s"]) <= BINS and series["samples_per_point"] == 5
    assert found["vs_float_max_deg"] == max(series["vs_float_deg"]["roll"]) == 45.0
    assert found["vs_float_max_sample"] == 1234
    assert found["rmse_deg"] is None and found["reference"] is None


def test_gaps_in_the_reference_are_null(core: Core, replay: Replay) -> None:
    log = NineAxis.of(replay.log)
    q = log.attitude.copy()
    q[10:20] = np.nan
    gapped = dataclasses.replace(replay, log=dataclasses.replace(log, q=q).record())
    found, _ = section(core, gapped)
    curve = found["logs"][0]["series"]["vs_log_deg"]["heading"]
    assert [k for k, v in enumerate(curve) if v is None] == list(range(10, 20))
    assert found["rmse_deg"]["total"] > 0


def test_missing_parts_are_null_and_named(core: Core, replay: Replay) -> None:
    found, warnings = section(core)
    assert warnings == ["accuracy: no log was run"]
    assert found.pop("logs") == [] and set(found.values()) == {None}
    found, warnings = section(core, dataclasses.replace(replay, reference=None))
    assert warnings == ["accuracy: no float64 run of synthetic_60s to compare with"]
    assert found["vs_float_max_deg"] is None and found["float_rmse_deg"] is None
    assert found["rmse_deg"] is not None


def test_outputs_must_fit_the_log(replay: Replay) -> None:
    with pytest.raises(
        InputError,
        match=r"^outputs must all have one shape \(n,\), n 1 to 6000, "
        r"not \[\(2,\), \(3,\)\]$",
    ):
        Replay(replay.log, {"pitch": np.zeros(2), "roll": np.zeros(3)})
    with pytest.raises(InputError, match=r"^outputs must .* not \[\(6001,\)\]$"):
        Replay(replay.log, {"pitch": np.zeros(6001)})
