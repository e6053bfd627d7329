"""``python -m boresight`` is the command line."""

from __future__ import annotations

import runpy
import sys

import pytest

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize(("words", "code"), [(["list"], 0), (["run", "mekf", "nosuch"], 2)])
def test_it_ends_with_the_exit_code(words, code, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["boresight", *words])
    with pytest.raises(SystemExit) as stop:
        runpy.run_module("boresight", run_name="__main__")
    assert stop.value.code == code
    assert ("complementary: " in capsys.readouterr().out) == (code == 0)
