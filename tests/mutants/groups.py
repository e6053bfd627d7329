"""Which files are mutated, in two groups that are counted apart, and which tests watch each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

from boresight.sim.formal.registry import find_proofs
from tests.mutants.edits import Mutant
from tests.mutants.hardware import hardware_mutants
from tests.mutants.software import software_mutants

#: Compiler: from the graph to the microcode and the C. Comparison: what says whether they agree.
_COMPILER = (
    *("model/words", "model/lowering", "model/ops.py"),
    *("gateware/schedule", "gateware/microcode", "gateware/machine.py"),
    *(f"firmware/{name}.py" for name in ("body", "emit", "helpers", "layout", "names")),
    "firmware/floating",
    *("sim/compare", "sim/levels", "sim/records/segments.py"),
    *(f"sim/rtl/{name}.py" for name in ("cosim", "replay", "sharing")),
)
#: Where parts meet: tests elsewhere that alone see them at work, by the beginning of the file.
_BEYOND = {
    "gateware/system/attitude_": ["tests/sim/board/test_run.py", "tests/sim/board/test_deep.py"],
    "gateware/boards/": ["tests/gateware/boards/test_top.py"],
    "gateware/soc/attitude_soc": ["tests/sim/soc/test_board.py"],
    "gateware/soc/": ["tests/sim/soc/test_system.py"],
    "gateware/engine/": ["tests/sim/compare/test_check.py"],
    "sim/compare/": ["tests/sim/levels/test_level.py"],
    "model/lowering/": ["tests/bits/test_digests.py"],
    "model/words/": ["tests/bits/test_digests.py"],
    "gateware/schedule/": ["tests/bits/test_digests.py"],
    "gateware/microcode/": ["tests/bits/test_digests.py"],
}
_PROOF = "tests/sim/formal/test_prove.py::test_short_proof"
#: Tests that are no witnesses: they change the source's text themselves and want it as it is.
_NO_WITNESS = {"tests/sim/formal/test_mutants.py"}


def _hardware_files(root: Path) -> list[str]:
    return sorted(
        str(path.relative_to(root))
        for path in (root / "gateware").rglob("*.py")
        if "def elaborate(" in path.read_text(encoding="utf-8")
    )


def _compiler_files(root: Path) -> list[str]:
    results = [
        path
        for part in _COMPILER
        for path in sorted((root / part).glob("*.py") if (root / part).is_dir() else [root / part])
        if path.name != "__init__.py"
    ]
    return [str(path.relative_to(root)) for path in results]


#: How the files of a group are found, and its faults.
Group = tuple[Callable[[Path], list[str]], Callable[[str, str], list[Mutant]]]
GROUPS: Mapping[str, Group] = {
    "hardware": (_hardware_files, hardware_mutants),
    "compiler": (_compiler_files, software_mutants),
}


def all_mutants(root: Path, group: Group) -> list[Mutant]:
    """Every mutant of a group, in the order of files and text."""
    files, mutants = group
    return [m for file in files(root) for m in mutants(file, (root / file).read_text("utf-8"))]


def nearest_tests(root: Path, file: str) -> list[str]:
    """The mirrored test file and its kin; where there are none, all of the folder that import it.

    ``gateware/sensors/adis16385.py`` has ``tests/gateware/sensors/test_adis16385.py`` and
    ``test_adis16385_faults.py``; what mirrors ``adis16385_flags.py`` is that file's.
    """
    place = root / "tests" / Path(file).parent
    stem = Path(file).stem
    others = {p.stem for p in (root / file).parent.glob(f"{stem}_*.py")}
    kin = [p for p in place.glob(f"test_{stem}_*.py") if p.stem.removeprefix("test_") not in others]
    results = [*place.glob(f"test_{stem}.py"), *sorted(kin)]
    if not results:
        results = [p for p in sorted(place.glob("test_*.py")) if _imports(p, file)]
    return [str(p.relative_to(root)) for p in results]


def wider_tests(root: Path, file: str) -> list[str]:
    """Whatever imports the file, the tests of the same folder, those of where it is used, and the
    proofs of it that the tests run; not the nearest ones."""
    nearest = set(nearest_tests(root, file))
    near = set((root / "tests" / Path(file).parent).glob("test_*.py"))
    users = {p for p in (root / "tests").rglob("test_*.py") if _imports(p, file)}
    rows = [*sorted(near & users), *sorted(users - near), *sorted(near - users)]
    names = [str(p.relative_to(root)) for p in rows]
    names += [name for head, more in _BEYOND.items() if file.startswith(head) for name in more]
    names += _proofs(root, file)
    return [name for name in dict.fromkeys(names) if name not in nearest | _NO_WITNESS]


def _imports(test: Path, file: str) -> bool:
    module = "boresight." + file.removesuffix(".py").replace("/", ".")
    text = test.read_text(encoding="utf-8")
    return f"{module} import" in text or f"import {module}\n" in text


def _proofs(root: Path, file: str) -> list[str]:
    """The short proofs of blocks that import the file."""
    blocks = {p.stem for p in (root / "sim/formal/blocks").glob("*.py") if _imports(p, file)}
    return [f"{_PROOF}[{name}]" for name, block in _short_proofs() if block in blocks]


@cache
def _short_proofs() -> list[tuple[str, str]]:
    """Names, and the modules of their harnesses."""
    proofs = find_proofs([], short=True)
    return [(p.name, p.harness.__module__.rpartition(".")[2]) for p in proofs]
