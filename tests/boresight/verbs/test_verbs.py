"""Every verb: its help shows its examples, and takes them; its options have a text each."""

from __future__ import annotations

import pytest

from boresight.cli import help_of, main, verb_of
from boresight.verbs import VERBS
from tests.support.pages import parsed


@pytest.mark.parametrize("verb", VERBS)
def test_examples_are_taken_and_shown(verb, capsys):
    with pytest.raises(SystemExit) as done:
        main([verb, "--help"])
    assert done.value.code == 0
    said = capsys.readouterr().out
    summary, examples = help_of(verb)
    for line, what in examples:
        assert line.split()[:2] == ["boresight", verb]
        parsed(line)
        rows = [row.partition("  # ") for row in said.splitlines()]
        assert [what] == [why for row, _, why in rows if row.strip() == line]
    assert examples and summary.partition(".")[0] in " ".join(said.split())
    words = " ".join(said.split())
    for argument in verb_of(verb).arguments.values():
        assert len(argument.text) > 8 and argument.text[:30] in words
        assert all(flag in words for flag in argument.flags)


def test_the_help_of_all_names_every_verb(capsys):
    with pytest.raises(SystemExit) as done:
        main(["--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert done.value.code == 0
    assert all(f"{verb} {help_of(verb)[0]}" in said for verb in VERBS)
