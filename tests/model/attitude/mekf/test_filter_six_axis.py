"""`mekf` built without a magnetometer: what it leaves out, and the same attitude."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model.attitude.mekf import Mekf
from boresight.model.estimator import input_words
from boresight.model.resolve import estimator_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from tests.support.compiled_float import compiled_float

QUATERNION = ("qw", "qx", "qy", "qz")


def fixed_run(e: Mekf, x: np.ndarray) -> tuple[dict[str, np.ndarray], int]:
    """Outputs in units, and how many samples saturated."""
    program = e.compile()
    out, saturated = CModel(program).update(input_words(program, x[:, :, None])[:, :, 0])
    names = zip(program.output_names, program.outputs, strict=True)
    results = {name: program.format(n).real(out[:, k]) for k, (name, n) in enumerate(names)}
    return results, int(saturated.sum())


def test_it_is_the_filter_whose_field_never_comes() -> None:
    record = read_record(bundled("ximu_walk"))
    six, full = estimator_of("mekf(mag='none')"), Mekf()
    x = feed(full, record).inputs[:500]
    x[300, 0] = -0.1  # a gap
    x[400, 0] = -0.25  # begun anew
    x[:, 4:7] = 0.0
    bare = np.delete(x, (4, 5, 6), axis=1)
    assert [i.name for i in six.inputs] == ["dt", "gx", "gy", "gz", "ax", "ay", "az"]
    mine, result = (compiled_float(e, v[:, :, None])[0] for e, v in ((six, bare), (full, x)))
    for name in result:
        assert mine[name] == pytest.approx(result[name], abs=1e-12), name
    fixed, saturated = fixed_run(six, bare)
    assert not saturated
    assert np.array_equal(fixed["status"], mine["status"][:, 0])
    q, want = (np.stack([of[n].ravel() for n in QUATERNION]) for of in (fixed, mine))
    error = np.minimum(abs(q - want).max(axis=0), abs(q + want).max(axis=0))
    assert 1e-11 < error.max() < 5e-6


def test_it_leaves_out_what_only_a_field_needs() -> None:
    six, full = Mekf("none"), Mekf()
    assert six.name == "mekf_six_axis" and full.name == "mekf" and full.params == Mekf.params
    assert len(full.states) - len(six.states) == 7 and len(full.params) - len(six.params) == 6
    names = {p.name for p in six.params}
    assert {"gyro_var", "tilt_var", "start_var"} <= names
    assert not {"heading_var", "field_trust_s", "dip_trust_s", "field_min_sq"} & names
    sizes = [len(e.compile().ops) for e in (six, full)]
    assert sizes[0] < 0.85 * sizes[1]
