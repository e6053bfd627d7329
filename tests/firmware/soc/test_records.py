"""``records.h``: what C is told of estimators of any records."""

import re

from boresight.firmware.soc.records import records_header, sizes
from boresight.model.declarations import Input, Output
from boresight.model.estimator import Estimator
from boresight.model.resolve import estimator_of


class Other(Estimator):
    """An angle, bits and a number."""

    inputs = (Input("mz", -200.0, 200.0, "uT", missing=0.0), Input("x", -1.0, 1.0))
    outputs = (Output("angle", "ht"), Output("mode", "flags"), Output("size"))

    def step(self, x, u, p):
        return {}, {"angle": 0.5 * u.x, "mode": 0.0 * u.x + 3.0, "size": u.mz + u.x}


def rows(text: str, name: str) -> list[list[str]]:
    found = re.search(rf" {name}\[[^=]*= \{{(.*)\}};", text)
    assert found is not None, name
    inner = re.findall(r"\{([^}]*)\}", found[1]) or [found[1]]
    return [[word.strip() for word in row.split(",")] for row in inner]


def test_tables() -> None:
    programs = [estimator_of("mekf").compile(), Other().compile()]
    assert sizes(programs) == (10, 8)
    text = records_header(programs, outputs=0x510, inputs=0x520)
    assert "#define RECORD_OUTPUT_ADDR 1296u" in text and "#define RECORD_INPUTS 10u" in text
    assert rows(text, "record_inputs") == [["10", "2"]]
    assert rows(text, "record_outputs") == [["8", "3"]]
    assert rows(text, "record_step") == [["0", "-1"]]
    assert rows(text, "record_field") == [["UINT32_C(112)", "UINT32_C(1)"]]
    assert rows(text, "record_in_frac")[1] == ["23", "30"]
    fracs = [str(programs[1].values[n].frac) for n in programs[1].outputs]
    assert rows(text, "record_out_frac")[1] == fracs
    # Of an attitude heading, pitch, roll, status; of others all: angle, bits, number.
    assert rows(text, "record_place") == [["2", "0", "1", "7"], ["0", "1", "2"]]
    assert rows(text, "record_kind") == [["0u", "0u", "0u", "1u"], ["0u", "1u", "2u"]]
