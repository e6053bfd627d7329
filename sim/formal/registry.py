"""All proofs."""

from __future__ import annotations

import importlib
import pkgutil

from boresight.model.errors import InputError
from boresight.sim.formal.prove import Proof, ProofError, prove
from boresight.sim.formal.tools import find_tools

_PACKAGES = ("boresight.sim.formal.blocks", "boresight.sim.attitude.formal")

__all__ = ["all_proofs", "find_proofs", "prove_named"]


def all_proofs() -> tuple[Proof, ...]:
    """The proofs of every block, by name."""
    proofs: list[Proof] = []
    for name in _PACKAGES:
        package = importlib.import_module(name)
        for module in pkgutil.iter_modules(package.__path__):
            proofs += importlib.import_module(f"{name}.{module.name}").PROOFS
    names = [proof.name for proof in proofs]
    duplicates = sorted({name for name in names if names.count(name) > 1})
    if duplicates:
        raise ValueError(f"names of proofs must differ, not {', '.join(duplicates)} twice")
    return tuple(sorted(proofs, key=lambda proof: proof.name))


def find_proofs(names: list[str], *, short: bool = False) -> tuple[Proof, ...]:
    """Proofs with one of ``names``, or with a part before the dot among them; all without names.

    Parameters
    ----------
    names : list of str
        ``uart`` stands for all proofs ``uart.*``.
    short : bool
        Only the short ones.

    Raises
    ------
    InputError
        A name matches no proof.
    """
    proofs = all_proofs()

    def matching(name: str) -> list[Proof]:
        return [p for p in proofs if p.name == name or p.name.startswith(f"{name}.")]

    for name in names:
        if not matching(name):
            raise InputError.at(
                "NAME",
                wanted="a proof or the part before its dot",
                found=name,
                fix="see python -m boresight.sim.formal --list",
            )
    chosen = [p for p in proofs if not names or any(p in matching(name) for name in names)]
    return tuple(p for p in chosen if p.short or not short)


def prove_named(name: str, solver: str | None, timeout_s: float) -> tuple[bool, str]:
    """Whether a proof holds, and a line about it; by name, since a harness cannot be pickled."""
    (proof,) = (p for p in all_proofs() if p.name == name)
    try:
        result = prove(proof, tools=find_tools(solver), timeout_s=timeout_s)
    except ProofError as error:
        return False, f"NO ANSWER: {error}"
    if not result.proven:
        return False, f"FAILED after {result.seconds:.1f} s\n{result.report()}"
    line = f"proven  {result.method:24} {result.covers:2} covers {result.seconds:7.1f} s"
    return True, line
