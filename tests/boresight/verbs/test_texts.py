"""What verbs say of themselves: every example is a command line that the verb takes."""

from __future__ import annotations

import pytest

from boresight.cli import main
from boresight.verbs.texts import VERBS
from tests.support.pages import parsed


@pytest.mark.parametrize("verb", VERBS)
def test_examples_are_taken_and_shown(verb, capsys):
    with pytest.raises(SystemExit) as done:
        main([verb, "--help"])
    assert done.value.code == 0
    said = capsys.readouterr().out
    for line, what in VERBS[verb].examples:
        assert line.split()[0] == verb
        parsed(f"boresight {line}")
        rows = [row.partition("  # ") for row in said.splitlines()]
        assert [what] == [why for row, _, why in rows if row.strip() == f"boresight {line}"]
    assert VERBS[verb].examples and VERBS[verb].summary.partition(".")[0] in " ".join(said.split())
