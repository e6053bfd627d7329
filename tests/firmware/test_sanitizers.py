"""Both kinds of C of every filter on recorded data, under the sanitizers of the compiler."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.firmware.emit import emit_c
from boresight.firmware.floating import FloatCModel, emit_float_c, float_prefix
from boresight.model.attitude import estimator
from boresight.model.estimator import input_words
from boresight.sim.records.feed import feed
from boresight.sim.records.files import bundled, read_record

FLAGS = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Werror",
    "-O0",
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)

MAIN = """
#include "NAME.h"
#include <stdio.h>

int main(void) {
    static NAME_t filter;
    NAME_in_t in;
    NAME_out_t out;
    NAME_init(&filter);
    while (fread(&in, 4, LONG_INPUTS, stdin) == LONG_INPUTS) {
        NAME_update(&filter, &in, &out);
        fwrite(&out, 4, LONG_OUTPUTS, stdout);
    }
    return 0;
}
"""


def run(files: dict[str, str], name: str, words: bytes, folder: Path) -> bytes:
    """Outputs of an estimator that is compiled with all checks."""
    main = MAIN.replace("NAME", name).replace("LONG", name.upper())
    for file, text in {**files, "main.c": main}.items():
        (folder / file).write_text(text)
    subprocess.run(
        ["gcc", *FLAGS, f"{name}.c", "main.c", "-lm", "-o", "main"], cwd=folder, check=True
    )
    done = subprocess.run(["./main"], cwd=folder, input=words, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


@pytest.mark.parametrize("name", ["complementary", "ekf_quaternion", "ekf_bias", "mekf"])
def test_recorded_data(name: str, tmp_path: Path) -> None:
    e = estimator(name)
    records = feed(e, read_record(bundled("ximu_walk"))).inputs[:600]
    records[200, 3:] *= 1e6  # and what no sensor says
    records[400] = 0.0
    program = e.compile()
    words = input_words(program, records[..., None])[..., 0].astype(np.int32)
    said = run(emit_c(program), name, words.tobytes(), tmp_path)
    wanted, _ = CModel(program).update(words)
    assert (np.frombuffer(said, np.int32).reshape(wanted.shape) == wanted).all()

    single = records.astype(np.float32)
    files, name = emit_float_c(e, single=True), float_prefix(e, single=True)
    said = run(files, name, single.tobytes(), tmp_path)
    assert np.array_equal(
        np.frombuffer(said, np.float32).reshape(-1, len(e.outputs)),
        FloatCModel(e, single=True).update(single),
        equal_nan=True,
    )
