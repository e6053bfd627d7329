"""Run a harness in the solver: bounded model checking, induction, and reachability.

Three questions about one harness, all by yosys-smtbmc:

* **induction**: if the assertions have held for k cycles in a row, from any state, they
  hold in the next. With the bounded check of k cycles they hold for ever. The state at the
  beginning is not one that a reset reaches: whatever the harness needs to know about it must be
  among the assertions.
* **bounded**: no assertion fails within k cycles after power-up, or without induction within
  ``depth``, for any inputs and resets. Power-up means the initial values of all registers and
  memories; a reset may come in any cycle and any number of times, and leaves registers without
  reset as they are.
* **cover**: each ``Cover`` is reached, without a reset after power-up, so that the assumptions do
  not forbid what the proof is about.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.hdl import ClockDomain, Elaboratable, Module

from boresight.gateware.verilog import Device
from boresight.sim.formal.tools import Tools, find_tools, solver_environment
from boresight.sim.formal.trace import Trace, read_trace

__all__ = ["Proof", "ProofError", "ProofTimeout", "Result", "prove"]

#: Longest run of one program, seconds.
TIMEOUT_S = 600.0

_SCRIPT = """\
read_rtlil design.il
hierarchy -check -top top
proc
flatten
chformal -lower
async2sync
chformal -assume -early
opt_clean
memory_map -rom-only
memory_nordff
formalff -clk2ff -ff2anyinit
opt -fast
opt_clean
check -assert
setundef -undriven -anyseq
dffunmap
write_smt2 -wires design.smt2
"""


class ProofError(RuntimeError):
    """A program of the proof failed: neither proven nor refuted."""


class ProofTimeout(ProofError):
    """A program of the proof took too long."""


@dataclass(frozen=True, kw_only=True)
class Proof:
    """A statement about a component, and the parameters of its proof.

    Attributes
    ----------
    name : str
        Name, ``part.statement``.
    claim : str
        The statement in one sentence, with its parameters.
    harness : callable
        Makes the harness; called anew for every run.
    depth : int
        Cycles of the bounded check where there is no induction, or where it fails.
    induction : int
        Longest induction tried, in cycles; 0: the statement is proven up to ``depth`` only.
    cover : int, range or None
        Cycles within which each ``Cover`` is reached; None: ``depth``. A range: only these cycles
        are looked at (enough if all are `harness.reached`).
    short : bool
        Whether the proof takes only a few seconds; the tests run such proofs.
    reset : bool
        Resets may come at any time; False: never.
    """

    name: str
    claim: str
    harness: Callable[[], Elaboratable]
    depth: int
    induction: int = 0
    cover: int | range | None = None
    short: bool = True
    reset: bool = True

    @property
    def cover_cycles(self) -> range:
        """Cycles in which ``Cover`` is looked for."""
        if isinstance(self.cover, range):
            return self.cover
        return range(0, (self.depth if self.cover is None else self.cover) + 1)


@dataclass(frozen=True, kw_only=True)
class Result:
    """Outcome of a proof.

    Attributes
    ----------
    proof : Proof
        The proof.
    proven : bool
        Whether all assertions hold and all covers are reached.
    method : str
        Method: ``induction, k = 3`` or ``bounded, 80 cycles``.
    seconds : float
        Wall clock.
    covers : int
        ``Cover`` statements that were reached.
    failed : str
        Failure, with its source location; empty if ``proven``.
    trace : Trace or None
        For a failed assertion: the run that leads to it. After a failed induction the first cycle
        need not be one that a reset reaches.
    """

    proof: Proof
    proven: bool
    method: str
    seconds: float
    covers: int = 0
    failed: str = ""
    trace: Trace | None = field(default=None, repr=False)

    @property
    def refuted(self) -> bool:
        """Whether a run from power-up violates an assertion."""
        return self.failed.startswith("refuted")

    def report(self, *, last: int = 40) -> str:
        """Result as text: one line, and for a failure the last cycles of the run."""
        line = (
            f"{self.proof.name}: {self.method}, {self.covers} covers, {self.seconds:.1f} s"
            if self.proven
            else f"{self.proof.name}: {self.failed}"
        )
        return line if self.trace is None else f"{line}\n{self.trace.text(last=last)}"


class _WithoutReset(Elaboratable):
    """The harness with a clock alone."""

    def __init__(self, harness: Elaboratable) -> None:
        self.harness = harness
        self.domain = ClockDomain("sync", reset_less=True)

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        m.domains.sync = self.domain
        m.submodules.harness = self.harness
        return m


def _rtlil(proof: Proof) -> str:
    """The harness for yosys. Undriven clock and reset become inputs."""
    design: Elaboratable = proof.harness()
    ports = []
    if not proof.reset:
        design = _WithoutReset(design)
        ports.append(design.domain.clk)
    text: str = rtlil.convert(design, name="top", ports=ports, platform=Device(device=""))
    return text


def prove(
    proof: Proof,
    *,
    solver: str | None = None,
    timeout_s: float = TIMEOUT_S,
    tools: Tools | None = None,
) -> Result:
    """Prove or refute.

    Parameters
    ----------
    proof : Proof
        Statement and harness.
    solver : str, optional
        A key of `tools.SOLVERS`.
    timeout_s : float
        Longest run of one program, seconds.
    tools : Tools, optional
        Programs to use; by default those of `find_tools`.

    Raises
    ------
    ToolMissing
        yosys, smtbmc or the solver is not installed; the message says how to get it.
    ProofTimeout, ProofError
        Neither proven nor refuted.
    """
    tools = tools or find_tools(solver)
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="proof") as name:
        run = _Run(Path(name), tools, timeout_s, reset=proof.reset)
        run.prepare(_rtlil(proof))

        def result(proven: bool, method: str, **info: Any) -> Result:
            return Result(
                proof=proof, proven=proven, method=method, seconds=time.monotonic() - start, **info
            )

        if proof.induction > proof.depth:
            raise ValueError(
                f"depth must be at least induction, {proof.induction}, not {proof.depth}"
            )
        depth, method = proof.depth, f"bounded, {proof.depth} cycles"
        induction_failure: dict[str, Any] = {}
        if proof.induction:
            log, passed = run.smtbmc(proof.induction, "-i")
            last = re.findall(r"Trying induction in step (\d+)", log)[-1] if passed else 0
            steps = proof.induction - int(last)
            method = f"induction, k = {steps}"
            if passed:
                # smtbmc's step is between states after the first, so from that one k more.
                depth = steps
            else:
                induction_failure = {
                    "failed": "not inductive: " + _failed_assertions(log),
                    "trace": run.trace(),
                }
        log, passed = run.smtbmc(depth + 1)
        if not passed:
            failed = "refuted: " + _failed_assertions(log)
            return result(False, method, failed=failed, trace=run.trace())
        reached, missed = run.covers(proof.cover_cycles)
        if missed or not reached:
            return result(
                False,
                "cover",
                covers=reached,
                failed="not reached: " + (", ".join(missed) or "the harness has no Cover"),
            )
        return result(not induction_failure, method, covers=reached, **induction_failure)


class _Run:
    """Files and programs of one proof."""

    def __init__(self, folder: Path, tools: Tools, timeout_s: float, *, reset: bool) -> None:
        self.folder = folder
        self.reset = reset
        self.tools = tools
        self.timeout_s = timeout_s

    def prepare(self, text: str) -> None:
        """From RTLIL to formulas."""
        (self.folder / "design.il").write_text(text)
        (self.folder / "design.ys").write_text(_SCRIPT)
        log, code = self._start([*self.tools.yosys, "-q", "design.ys"])
        if code:
            raise ProofError(f"yosys did not take the harness: {log.strip()[-2000:]}")

    def smtbmc(self, steps: int | str, *options: str) -> tuple[str, bool]:
        """Run smtbmc; its output, and whether the answer is yes."""
        (self.folder / "trace.vcd").unlink(missing_ok=True)
        log, code = self._start(
            [
                *self.tools.smtbmc,
                "-s",
                self.tools.solver,
                "--noprogress",
                "-m",
                "top",
                "-t",
                str(steps),
                *options,
                "--dump-vcd",
                "trace.vcd",
                "design.smt2",
            ]
        )
        if "Status: PASSED" in log and not code:
            return log, True
        if "Status: FAILED" in log or "Status: failed" in log:
            return log, False
        raise ProofError(f"smtbmc gave no answer: {log.strip()[-2000:]}")

    def covers(self, cycles: range) -> tuple[int, list[str]]:
        """Number of ``Cover`` reached, and source locations of the others.

        Without a ``Cover`` the solver is not asked: smtbmc would give it a vector of no bits, which
        it refuses and ends, before or after smtbmc has written its next line.
        """
        if "; yosys-smt2-cover " not in (self.folder / "design.smt2").read_text():
            return 0, []
        constraints = self.folder / "quiet.smtc"
        constraints.write_text("always\nassume (= [rst] false)\n" if self.reset else "")
        log, _ = self.smtbmc(f"{cycles.start}:{cycles.stop}", "-c", "--smtc", constraints.name)
        return (
            len(re.findall(r"Reached cover statement", log)),
            _locations(re.findall(r"Unreached cover statement at (.*)", log)),
        )

    def trace(self) -> Trace | None:
        """The counterexample of the last run."""
        path = self.folder / "trace.vcd"
        return read_trace(path.read_text()) if path.exists() else None

    def _start(self, command: list[str]) -> tuple[str, int]:
        # A separate process group, so that the solver ends with smtbmc.
        with subprocess.Popen(
            command,
            cwd=self.folder,
            env=solver_environment(),
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        ) as process:
            try:
                log, _ = process.communicate(timeout=self.timeout_s)
            except BaseException as error:
                os.killpg(process.pid, signal.SIGKILL)
                if isinstance(error, subprocess.TimeoutExpired):
                    raise ProofTimeout(f"no answer within {self.timeout_s:g} s") from error
                raise
        return log, process.returncode


def _locations(texts: Iterable[str]) -> list[str]:
    """Source locations without their folders."""
    return [re.sub(r"^.*?([^/\s]+\.py:\d+).*$", r"\1", text.strip()) for text in texts]


def _failed_assertions(log: str) -> str:
    """Source locations of the failed assertions."""
    locations = _locations(re.findall(r"Assert failed in .*?: (.*)", log))
    return ", ".join(dict.fromkeys(locations)) or "unknown location"
