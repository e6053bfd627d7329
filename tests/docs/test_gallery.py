"""`examples/`: textbook filters with their worlds, in every form, compiled, and on their page."""

from __future__ import annotations

import importlib.util
import re

import numpy as np
import pytest

import boresight
from tests.support.pages import ROOT
from tests.support.strangers import EXAMPLES

_spec = importlib.util.spec_from_file_location("gallery", EXAMPLES / "gallery.py")
assert _spec is not None and _spec.loader is not None
gallery = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(gallery)


@pytest.mark.parametrize("world", gallery.worlds())
def test_a_textbook_filter(world: str, tmp_path) -> None:
    file, page = gallery.file_of(world), (ROOT / "docs" / "learn" / "examples.md").read_text()
    assert gallery.author_lines(file) <= 40
    (row,) = re.findall(rf"^\|[^|]*examples/{file.name}\)[^|]*\| (\d+) \| (\d+) \|", page, re.M)
    result = gallery.checked(world, ("fixed", "c"))
    assert result.good, result.lines()
    assert gallery.author_lines(file) == int(row[0])
    assert result.build.core.schedule.length == int(row[1])
    rtl = gallery.checked(world, ("fixed", "rtl"), steps=60)
    assert rtl.good and [x.n_total for x in rtl.levels] == [60, 60]
    log = result.given.record
    numpy, compiled = (boresight.run(str(file), log, levels=on) for on in ("numpy", "float"))
    for output, values in numpy["outputs"].items():
        assert np.allclose(values, compiled["outputs"][output], rtol=1e-9, atol=1e-9)
    boresight.compile(str(file), output=tmp_path / "build", word=gallery.WORD)
    assert (tmp_path / "build" / "core.v").stat().st_size
