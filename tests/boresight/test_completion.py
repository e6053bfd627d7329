"""`boresight --print-completion`: scripts that the shells understand, and what bash offers."""

from __future__ import annotations

import shlex
import shutil
import subprocess

import pytest
import shtab

from boresight.cli import main
from boresight.verbs import VERBS

#: Words behind `boresight`, the last one begun, and all words that have to be offered.
TYPED = {
    ("",): list(VERBS),
    ("ch",): ["check"],
    ("compile", "--bo"): ["--board"],
    ("simulate", "--fe"): ["--feed"],
    ("check", "car"): ["cart.csv", "cart.py"],
    ("run", "cart.py", "--param"): ["--param", "--params"],
}
#: What bash does when Tab is pressed.
ASK = """
ask() {
    COMP_WORDS=(boresight "$@"); COMP_CWORD=$#; COMPREPLY=()
    _shtab_boresight; echo "${COMPREPLY[@]}"
}
"""


@pytest.fixture
def script(capsys):
    def of(shell: str) -> str:
        with pytest.raises(SystemExit) as done:
            main(["--print-completion", shell])
        assert done.value.code == 0
        return capsys.readouterr().out

    return of


@pytest.mark.parametrize("shell", shtab.SUPPORTED_SHELLS)
def test_names_every_verb(shell, script):
    text = script(shell)
    assert all(verb in text for verb in VERBS)


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_what_bash_offers(script, tmp_path):
    for name in ("cart.py", "cart.csv", "other.txt"):
        (tmp_path / name).touch()
    asks = [f"ask {shlex.join(words)}" for words in TYPED]
    text = "\n".join([script("bash"), ASK, *asks])
    done = subprocess.run(
        ["bash", "--norc"], input=text, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    for wanted, offered in zip(TYPED.values(), done.stdout.splitlines(), strict=True):
        assert sorted(wanted) == sorted(offered.split())


def test_an_unknown_shell_is_one_line(capsys):
    with pytest.raises(SystemExit) as done:
        main(["--print-completion", "fish-and-chips"])
    assert done.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
