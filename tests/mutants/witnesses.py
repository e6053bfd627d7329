"""Proofs alone, or the search alone, as witnesses of faults in what makes a compiled core."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from tests.mutants.groups import Group
from tests.mutants.hardware import hardware_mutants
from tests.mutants.software import software_mutants

_PLACES = {
    "scheduler": ("gateware/schedule/*.py",),
    "allocator": ("gateware/schedule/allocate.py", "gateware/schedule/copies.py"),
    "assembler": tuple(f"gateware/microcode/{x}.py" for x in ("assemble", "image", "layout")),
    "emitter": tuple(f"firmware/{x}.py" for x in ("body", "emit", "helpers", "layout", "names")),
    "engine": ("gateware/engine/*.py",),
}


def _files(part: str, root: Path) -> list[str]:
    """Files of a part; what the allocator is made of is not the scheduler's."""
    results = {p for place in _PLACES[part] for p in root.glob(place) if p.name != "__init__.py"}
    if part == "scheduler":
        results -= {root / place for place in _PLACES["allocator"]}
    return sorted(str(path.relative_to(root)) for path in results)


#: The parts: their files, and their faults.
PARTS: Mapping[str, Group] = {
    part: (partial(_files, part), hardware_mutants if part == "engine" else software_mutants)
    for part in _PLACES
}

_PROOF = "test_shipped_programs or test_linked_programs or test_programs_that or test_random"
_COMPILED = ["tests/gateware/microcode/test_validation.py", "tests/firmware/test_validation.py"]
_MEMORIES = "tests/gateware/texts/test_memories.py"
_FORMAL = "test_short_proof and (lane or operands or sequencer)"


def proof(root: Path, file: str) -> list[str]:
    """What runs the proofs of each core, or of the engine's parts, for pytest."""
    if file.startswith("gateware/engine/"):
        return ["tests/sim/formal/test_prove.py", "-k", _FORMAL]
    return [*_COMPILED, _MEMORIES, "-k", f"{_PROOF} or test_one_digit"]


def search(root: Path, file: str) -> list[str]:
    """What draws random programs for some minutes, for pytest."""
    return ["tests/support/soak/test_soak.py::test_ten_minutes", "-m", "soak"]


#: Witnesses by name.
WITNESSES: Mapping[str, Callable[[Path, str], list[str]]] = {"proof": proof, "search": search}
