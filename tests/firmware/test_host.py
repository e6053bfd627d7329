"""`firmware.host`: what the host's file declares (`test_build` runs it)."""

import re

from boresight.firmware.body import Body
from boresight.firmware.host import host_source
from boresight.model.words.program import Program


def test_entry_points(odd_names: Program) -> None:
    text = host_source(Body(odd_names, prefix="odd"))
    assert text.index('#include "odd.c"') < text.index("size_t odd_size(void);")
    for name in ("odd_size", "odd_set_param", "odd_run", "odd_each"):
        found = re.findall(rf"^(?:void|size_t) {name}\(", text, re.MULTILINE)
        assert len(found) == 2, "a declaration and a definition"
