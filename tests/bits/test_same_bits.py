"""All that ``boresight compile`` writes is the same, byte for byte, on every machine.

One machine stands for many: OpenBLAS and numpy are told to be an older processor, and functions of
``math`` and numpy are moved in the last bit (`off_by_one`), which no real library exceeds by much.
"""

from __future__ import annotations

import difflib
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.pythons

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
#: Kernels of OpenBLAS that every processor of this kind can run, the oldest first.
KERNELS = {
    "x86_64": ("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen"),
    "AMD64": ("Prescott", "Nehalem", "Sandybridge", "Haswell", "Zen"),
    "aarch64": ("ARMV8", "CORTEXA57", "CORTEXA53", "NEOVERSEN1", "THUNDERX"),
    "arm64": ("ARMV8", "CORTEXA57", "NEOVERSEN1", "VORTEX"),
}.get(platform.machine(), ("GENERIC",))
_ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def vector_features() -> list[str]:
    """Instruction sets that numpy uses here and can do without."""
    umath = np._core._multiarray_umath
    return [name for name in umath.__cpu_dispatch__ if umath.__cpu_features__.get(name)]


@dataclass(frozen=True)
class Machine:
    """What one run of `compile_all` finds around it.

    ``vectors``: how many of `vector_features` numpy may use, the oldest first; None: all.
    ``moved``: the sources, the working folder and the output lie elsewhere.
    """

    name: str
    environment: Mapping[str, str] = field(default_factory=dict)
    vectors: int | None = None
    options: Sequence[str] = ()
    moved: bool = False


#: Everything that may differ, in one.
OTHER = Machine(
    "other",
    {
        **_ASCII,
        "OPENBLAS_CORETYPE": KERNELS[0],
        "PYTHONHASHSEED": "4711",
        "TZ": "Pacific/Apia",
        "PYTHONOPTIMIZE": "1",
        "AMARANTH_verbose": "1",
        "COLUMNS": "40",
    },
    vectors=0,
    options=("--off-by-one",),
    moved=True,
)


def made_by(machine: Machine, folder: Path, *options: str) -> dict[str, tuple[int, bytes]]:
    """Mode and bytes of every file that a machine writes."""
    folder.mkdir()
    source, work, out = ROOT, folder, folder / "out"
    if machine.moved:
        source, work, out = folder / "quelle, ä", folder / "deep" / "er", folder / "une sortie"
        shutil.copytree(ROOT / "boresight", source / "boresight", ignore=_CACHES)
        work.mkdir(parents=True)
    environment = {
        k: v
        for k, v in os.environ.items()
        if not k.startswith(("OPENBLAS", "NPY_", "PYTHON", "LC_"))
    }
    environment |= {"PYTHONPATH": str(source), **machine.environment}
    if machine.vectors is not None:
        environment["NPY_DISABLE_CPU_FEATURES"] = " ".join(vector_features()[machine.vectors :])
    done = subprocess.run(
        [sys.executable, HERE / "compile_all.py", out, *machine.options, *options],
        cwd=work,
        env=environment,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr.decode(errors="replace")
    assert Path(os.fsdecode(done.stdout)) == source / "boresight"
    results = [path for path in sorted(out.rglob("*")) if path.is_file()]
    return {str(p.relative_to(out)): (p.stat().st_mode, p.read_bytes()) for p in results}


_CACHES = shutil.ignore_patterns("__pycache__", "*.pyc")


def difference(a: Mapping[str, tuple[int, bytes]], b: Mapping[str, tuple[int, bytes]]) -> str:
    """Which files differ, and how the first of them does; nothing if none do."""
    if a.keys() != b.keys():
        return f"files that only one of them wrote: {sorted(a.keys() ^ b.keys())}"
    names = [name for name in a if a[name] != b[name]]
    if not names:
        return ""
    texts = [side[names[0]][1].decode(errors="replace").splitlines() for side in (a, b)]
    lines = list(difflib.unified_diff(*texts, "here", "there", n=0, lineterm=""))[:20]
    return "\n".join([f"{len(names)} files differ: {names[:12]}", names[0], *lines])


def test_another_machine(tmp_path: Path) -> None:
    here = made_by(Machine("here"), tmp_path / "here", "--brief")
    assert {"system/core.v", "system/report.json", "others-0/core.v"} <= here.keys()
    assert {"system/ise-mimas/top.v", "programs/mekf-32/program.json"} <= here.keys()
    assert all(data for _, data in here.values())
    there = made_by(OTHER, tmp_path / "there", "--brief")
    assert not (result := difference(here, there)), result


def test_text_is_utf_8_whatever_the_locale(tmp_path: Path) -> None:
    """Units and meanings of a user's own parameters may hold any letter."""
    code = (
        "import sys; from pathlib import Path; from boresight.verbs import compile as verb;"
        "verb.write_text(Path(sys.argv[1]), '\\u00b5T\\n')"
    )
    subprocess.run(
        [sys.executable, "-c", code, tmp_path / "text"],
        env={**os.environ, **_ASCII},
        cwd=ROOT,
        check=True,
    )
    assert (tmp_path / "text").read_bytes() == b"\xc2\xb5T\n"
