"""`firmware.observe`: what an observed update tells (`test_build` runs it)."""

import re

from boresight.firmware.body import Body
from boresight.firmware.observe import observe_source
from boresight.model.words.program import Program


def test_entry_point(odd_names: Program) -> None:
    text = observe_source(Body(odd_names, prefix="odd"))
    assert '#include "odd.h"' in text and '.c"' not in text
    found = re.findall(r"^void odd_observe\(", text, re.MULTILINE)
    assert len(found) == 2, "a declaration and a definition"


def test_every_word_is_given(odd_names: Program) -> None:
    text = observe_source(Body(odd_names))
    assert all(f"words[{n}] = " in text for n in range(len(odd_names.values)))


def test_saturations_are_counted_one_by_one(odd_names: Program) -> None:
    text = observe_source(Body(odd_names))
    assert all(f"saturations[{op.dest}] += saturated" in text for op in odd_names.ops)
