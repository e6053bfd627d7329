"""Programs that came from a file: a good one passes, and every fault has its words."""

import json

import pytest

from boresight.model.estimators import ESTIMATORS
from boresight.model.words.check import check_program
from boresight.model.words.program import Program
from tests.support.bad_files import changed


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (("name", "a*/b"), "the name"),
        (("name", 5), "a name that is no text"),
        (("arithmetic", "headroom", 3), "an arithmetic that no core has"),
        (("arithmetic", "word", 40), "word must be 18 to 32"),
        (("values", 0, "frac", "1"), "value with frac '1'"),
        (("values", 0, "frac", True), "value with frac 'True'"),
        (("values", 0, "initial", 2**40), "outside its word"),
        (("values", 0, "kind", "const"), "inputs that are not listed once each"),
        (("values", 0, "kind", "none"), "not a valid Kind"),
        (("inputs", 0, 10**6), "a reference to no value"),
        (("outputs", 0, 1.5), "a reference that is no number"),
        (("outputs", []), "outputs without a name"),
        (("ops", 0, "terms", []), "an operation without terms"),
        (("ops", 0, "terms", 0, "shift", 32), "a shift of 32"),
        (("ops", 0, "terms", 0, "a", -1), "reads what is not there yet"),
        (("ops", 0, "terms", 0, "b", None), "a term of one factor"),
        (("ops", 0, "dest", 0), "whose result has another place"),
        (("ops", 0, "table", 99), "a table"),
        (("ops", []), "a value that no operation gives"),
        (("table_memory", [0] * 511), "a table that is none"),
        (("states", 0, [0, 0]), "states that are not listed once each"),
    ],
)
def test_programs_that_no_level_can_run(path, message: str) -> None:
    program = ESTIMATORS["complementary"]().compile(word=18)
    check_program(program)
    data = json.loads(program.to_json())
    with pytest.raises(ValueError, match=message):
        check_program(Program.from_json(json.dumps(changed(data, *path))))
