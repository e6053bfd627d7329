"""`examples/`: textbook filters with their worlds, in every form, compiled, and on their page."""

from __future__ import annotations

import importlib.util

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
    file = gallery.file_of(world)
    assert gallery.author_lines(file) <= 40
    result = gallery.checked(world, ("fixed", "c", "rtl"))
    assert result.good and len(result.levels) == 3, result.lines()
    page = (ROOT / "docs" / "learn" / "examples.md").read_text(encoding="utf-8")
    assert gallery.row(world, result) in page.splitlines()
    log = result.given.record.head(60)
    numpy, compiled = (boresight.run(str(file), log, levels=on) for on in ("numpy", "float"))
    for output, values in numpy["outputs"].items():
        assert np.allclose(values, compiled["outputs"][output], rtol=1e-9, atol=1e-9)
    boresight.compile(str(file), output=tmp_path / "build", word=gallery.WORD)
    assert (tmp_path / "build" / "core.v").stat().st_size
