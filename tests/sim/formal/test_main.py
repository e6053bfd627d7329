"""``python -m boresight.sim.formal``: its table, its exit code."""

import pytest

from boresight.model.errors import ToolMissing
from boresight.sim.formal import __main__ as command
from boresight.sim.formal.prove import Proof, ProofError, Result


def test_a_proof_that_holds(capsys) -> None:
    assert command.main(["crc.frames"]) == 0
    out = capsys.readouterr().out
    assert "[ 1/1] crc.frames proven  induction, k = 1" in out
    assert out.splitlines()[-1].startswith("1 of 1 proven in ")
    assert command.main(["--list", "crc"]) == 0
    assert capsys.readouterr().out.startswith("crc.frames ")
    assert command.main(["nothing"]) == 2
    assert capsys.readouterr().err.startswith("error: NAME: wanted ")


@pytest.mark.parametrize(
    ("end", "line"),
    [
        (False, "FAILED after 1.5 s\ncrc.frames: the assertion"),
        (ProofError("it stopped"), "NO ANSWER: it stopped"),
    ],
)
def test_a_proof_that_does_not(end, line: str, monkeypatch, capsys) -> None:
    def prove(proof: Proof, **options: object) -> Result:
        if end:
            raise end
        return Result(
            proof=proof, proven=False, method="", seconds=1.5, failed="the assertion", trace=None
        )

    monkeypatch.setattr(command, "prove", prove)
    assert command.main(["crc.frames"]) == 1
    out = capsys.readouterr().out
    assert line in out and "0 of 1 proven in " in out


def test_a_missing_tool(monkeypatch, capsys) -> None:
    def find_tools(solver: str | None) -> None:
        raise ToolMissing("proofs need a solver")

    monkeypatch.setattr(command, "find_tools", find_tools)
    assert command.main(["--short"]) == 2
    assert capsys.readouterr().err == "error: proofs need a solver\n"
