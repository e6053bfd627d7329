"""Estimators: declared inputs, parameters, states and outputs, and one ``step``.

``step`` is written once with `model.ops`. `Estimator.compile` runs it once on tracing scalars and
gives the `Program`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from keyword import iskeyword
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from boresight.model import ops
from boresight.model.arrays import FloatArray, IntArray
from boresight.model.declarations import Input as Input
from boresight.model.declarations import Output as Output
from boresight.model.declarations import Param as Param
from boresight.model.declarations import State as State
from boresight.model.declarations import check_kind
from boresight.model.errors import author_line, placed, require, require_choice
from boresight.model.lowering.graph import Node
from boresight.model.lowering.lower import lower, watched
from boresight.model.lowering.profile import Profile
from boresight.model.lowering.trace import Trace, Tracer, repeatable
from boresight.model.step import Values, check_constants, checked
from boresight.model.words.fixed import Arithmetic, check_word
from boresight.model.words.program import InPort, Kind, Port, Program

#: Kinds of faults of a model that an estimator may waive: a gate that accepts few innovations,
#: a held sample that is fused again, a constant time step that is not the log's.
WAIVED = ("gate", "hold", "time step")
#: Angle [deg] of a start that needs no warning.
FINE_START = 0.02
#: What is declared: what messages call it, the attribute, its class.
_KINDS = (
    ("input", "inputs", Input),
    ("parameter", "params", Param),
    ("state", "states", State),
    ("output", "outputs", Output),
)


class Size(NamedTuple):
    """A largest value that an author declares, and what it bounds in the record."""

    name: str  #: "slope_max" of a measurement, "sd_max" of a state or of a measurement.
    state: str  #: whose deviation it is, or by which the derivative is taken; or empty.
    line: str
    stated: float  #: its value, in its author's unit; what intervals allow where there is none.
    largest: float  #: the same in the record, which may measure angles in half turns.
    value: int  #: number of the expression that it bounds: a derivative, or a variance.


@dataclass(frozen=True)
class SecondForm:
    """Results of an estimator's equations in another form: outputs (n,) by name."""

    outputs: Mapping[str, FloatArray]
    #: Lines about the model, which `check` prints as warnings.
    remarks: Sequence[str] = ()
    #: Faults of the model with their kinds: `check` fails unless the estimator waives the kind.
    faults: Sequence[tuple[str, str]] = ()
    #: Constant time steps of the model, s, by what has them; `check` compares the log's.
    time_steps: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    #: Outputs with what only rounding needs, such as a floor of the process noise: where
    #: ``outputs`` differ from the estimator's and these do not, that is the cause.
    as_built: Callable[[], Mapping[str, FloatArray]] | None = None
    #: After each update, (n, errors, errors).
    covariances: FloatArray | None = None
    #: Remarks about what no update shows, given the inputs (m, n_inputs) that follow in the log.
    absent: Callable[[FloatArray], Sequence[str]] | None = None


class Estimator:
    """Base class of every estimator.

    Attributes describe the interface, `step` the mathematics. They are set on the class, or on the
    object by its constructor.

    Attributes
    ----------
    name : str
        By default the class's name in lower case.
    summary : str
        One line; by default the first line of the class's docstring.
    inputs, params, states, outputs : tuple
        Declarations, in the order of the words.
    urgent : int, optional
        Number of leading outputs whose latency is minimised first; by default all.
    """

    name: str = "estimator"
    summary: str = ""
    inputs: tuple[Input, ...] = ()
    params: tuple[Param, ...] = ()
    states: tuple[State, ...] = ()
    outputs: tuple[Output, ...] = ()
    urgent: int | None = None
    #: Whether an input ``dt`` below 0 restarts it.
    restarts: bool = False
    #: Longest gap, s, whose length it takes from such a ``dt`` in place of a restart.
    bridges_s: float = 0.0
    #: Kinds of faults of the model (`WAIVED`) that are no failure of `check`.
    waived: tuple[str, ...] = ()
    #: Sample rates of inputs, Hz by name, for which the gains are designed; empty: any.
    rates_hz: Mapping[str, float] = {}
    #: Shortest word, in bits, in which the estimator's claims about its values hold.
    least_word: int = 18
    #: Largest angle [deg] from float64 in the first rows with an attitude, at rest with the noise
    #: of sensors in fields up to 75 deg steep, by the shortest word from which on it holds; empty:
    #: unknown.
    start_deg: Mapping[int, float] = {}
    #: Degrees of freedom of an output ``nis``, the normalised innovation squared; 0: without.
    nis_freedom: int = 0
    #: States that are elements of a covariance, with their row and column by name; empty: those
    #: named like ``p01`` or ``p_xy``.
    covariance_elements: Mapping[str, tuple[str, str]] = {}
    #: What narrows the range of the argument of a root, or of a covariance, by its line.
    remedies: Mapping[str, str] = {}
    #: Largest values that its author declares of what the record computes.
    sizes: Sequence[Size] = ()
    #: Source location of the class, "file.py, line 12".
    _line: str = ""
    #: Ranges for which formats are chosen beside the intervals; None: intervals alone.
    profile: Profile | None = None
    #: Meaning of the bits of an output ``status``, by number, for the texts about a core.
    status_bits: Mapping[int, str] = {}

    def __init_subclass__(cls) -> None:
        attributes = vars(cls)
        cls._line = author_line()
        if "name" not in attributes:
            cls.name = cls.__name__.lower()
        if "summary" not in attributes and (text := (attributes.get("__doc__") or "").strip()):
            cls.summary = text.splitlines()[0].rstrip(".")

    def check_declarations(self) -> None:
        """Refuse declarations that contradict each other.

        InputError: a declaration that is not a tuple of its kind, a name that is illegal or occurs
        twice, a parameter with the name of an input or state, no output, ``urgent`` above the
        number of outputs, ``valid_of`` without an input that has samples, ``rates_hz`` that are no
        rates of the log and of inputs.
        """
        name = f"estimator {self.name}"
        where = placed(self._line, name)
        _check_name(where, "estimator", self.name)
        for noun, group, kind in _KINDS:
            declared = getattr(self, group)
            several = isinstance(declared, tuple | list)
            for d in declared if several else [declared]:
                found = f"{'a' if several else 'one'} {type(d).__name__}"
                fix = f"write {group} = ({kind.__name__}(...),), also where there is only one"
                good = several and isinstance(d, kind)
                require(good, f"{where}, {group}", f"a tuple of {kind.__name__}", found, fix)
            names = set[str]()
            for d in declared:
                place = placed(d.line, name)
                _check_name(place, noun, d.name)
                require(d.name not in names, place, f"each {noun} once", d.name, "rename one")
                names.add(d.name)
        check_attributes(self, Estimator)
        inputs, outputs, rates = self.inputs, self.outputs, self.rates_hz
        taken = {i.name for i in inputs} | {s.name for s in self.states}
        for p in self.params:
            place = placed(p.line, f"{name}, parameter {p.name}")
            wanted = "a name that no input or state has"
            require(p.name not in taken, place, wanted, p.name, "rename one")
        require(bool(outputs), where, "an output", outputs, "declare outputs")
        fix = "it counts the leading outputs whose latency counts first"
        urgent = self.urgent is None or 0 <= self.urgent <= len(outputs)
        require(urgent, where, f"urgent of 0 to {len(outputs)}", self.urgent, fix)
        sampled = [i.name for i in inputs if not i.flags]
        for i in inputs:
            place = placed(i.line, f"{name}, input {i.name}")
            fix = f"choose {', '.join(sampled) or 'inputs with columns'}"
            for other in i.flags:
                require(other in sampled, place, "valid_of names of inputs", other, fix)
        good = isinstance(rates, Mapping) and {*rates} <= {"dt", *(i.name for i in inputs)}
        good = good and (not rates or "dt" in rates)
        good = good and all(isinstance(r, Real) and 0.0 < r < math.inf for r in rates.values())
        wanted = "samples a second, of the log (dt) and of inputs, by name"
        fix = 'write for example rates_hz = {"dt": 100.0}'
        require(good, f"{where}, rates_hz", wanted, rates, fix)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update: state ``x``, inputs ``u``, parameters ``p`` (attributes by name).

        Returns the next states and the outputs, by name.
        """
        raise NotImplementedError

    def for_rates(self, rates_hz: Mapping[str, float]) -> Estimator:
        """Return the estimator for these sample rates of inputs; itself if it serves any rate."""
        return self

    def error_covariance(
        self, states: Mapping[str, FloatArray], params: Mapping[str, float]
    ) -> tuple[tuple[str, ...], FloatArray] | None:
        """Names of some outputs, and the covariance (n, k, k) of their errors, as estimated.

        In their units, of states (n,) by name after an update; None if the estimator has none.
        """
        return None

    def textbook(
        self, inputs: FloatArray, params: Mapping[str, float] | None = None
    ) -> SecondForm | None:
        """The same equations in another form, in float64; None without such a form.

        ``inputs`` (n, n_inputs) are in their units, from a reset on.
        """
        return None

    # -- parameters -----------------------------------------------------------------------------

    def param_values(self, given: Mapping[str, float] | None = None) -> dict[str, float]:
        """Defaults with ``given`` on top; InputError: unknown name, or a value out of range."""
        legal = {p.name: p for p in self.params}
        values = {name: p.default for name, p in legal.items()}
        for name, value in (given or {}).items():
            require_choice(f"parameter {name}", name, legal, "correct the name")
            p = legal[name]
            inside = not isinstance(value, str) and p.low <= value <= p.high  # NaN is not
            wanted = f"{p.low:g} to {p.high:g} {p.unit}".rstrip()
            require(inside, f"parameter {name}", wanted, value, "choose a value inside the range")
            values[name] = float(value)
        return values

    # -- program --------------------------------------------------------------------------------

    def compile(self, *, word: int = 32) -> Program:
        """Trace `step` and lower it to a fixed-point `Program` of ``word`` bits.

        InputError: width outside 18 to 32, declarations that contradict each other, a step that
        raises or returns other than its states and outputs, or a value that fixed point cannot
        hold (named).
        """
        return self.compile_traced(word=word)[0]

    def start_note(self, word: int) -> str:
        """A line about a start that is coarse in a word of so many bits; empty if it is not."""
        bound = max((of for of in self.start_deg.items() if of[0] <= word), default=(0, 0.0))[1]
        fine = min((bits for bits, deg in self.start_deg.items() if deg <= FINE_START), default=0)
        text = f"{self.name}: the first rows with an attitude are up to {bound:g} deg from float64 "
        text += f"in a word of {word} bits, {FINE_START:g} deg from {fine} bits on"
        return text if bound > FINE_START else ""

    def compile_traced(self, *, word: int = 32) -> tuple[Program, dict[int, Node]]:
        """`compile`, and the node of each value of the program, by value number.

        Values that belong to no node (constants, parts of a function) are left out.
        """
        check_word(word)
        fix = "choose a wider word: its covariance does not stay positive in this one"
        trace = self.record()
        wide, wanted = word >= self.least_word, f"a word of {self.least_word} bits or more"
        require(wide, f"estimator {self.name}", wanted, word, fix)
        profile = self.profile and self.profile.check(trace, self.name, self.inputs)
        program, nodes = lower(trace, Arithmetic(word=word), profile)
        raw = (n for n, i in zip(program.inputs, self.inputs, strict=True) if not i.clamp)
        program = watched(program, raw)
        bits = "; ".join(f"{k}: {meaning}" for k, meaning in self.status_bits.items())
        ports = tuple(
            Port(o.name, o.unit, o.tolerance, o.meaning or bits * (o.name == "status"))
            for o in self.outputs
        )
        in_ports = tuple(InPort(i.missing, i.flags, i.explained) for i in self.inputs)
        urgent = len(self.outputs) if self.urgent is None else self.urgent
        return replace(program, ports=ports, urgent=urgent, in_ports=in_ports), nodes

    def record(self) -> Trace:
        """Record one `step`; refuse it if a second run records other operations.

        InputError: declarations that contradict each other; no input; an error of `checked_step`;
        or a second run that differs.
        """
        self.check_declarations()
        where = placed(self._line, f"estimator {self.name}")
        fix = 'declare one, for example Input("dt", 0.0, 0.1, "s")'
        require(bool(self.inputs), where, "an input, whose word begins an update", (), fix)
        recorded, repeated = self.trace(), self.trace()
        expressions = (recorded.tracer.expressions, repeated.tracer.expressions)
        keys = [[e.key for e in each] for each in expressions]
        for k, (first, second) in enumerate(zip_longest(*keys)):
            if first != second:
                lines = [e.line for each in expressions for e in each[k:] if e.line]
                repeatable(False, (lines or [f"estimator {self.name}"])[0])
        return recorded

    def trace(self) -> Trace:
        """Record one `step`; InputError as of `checked_step`."""
        tracer = Tracer(self.name)
        u = {i.name: tracer.leaf("input", i.name, *i.span, i.unit) for i in self.inputs}
        p = {d.name: tracer.leaf("param", d.name, d.low, d.high, d.unit) for d in self.params}
        x = {s.name: tracer.leaf("state", s.name, s.low, s.high, s.unit) for s in self.states}
        clipped = u | {i.name: ops.clip(u[i.name], i.low, i.high) for i in self.inputs if i.beyond}
        arguments = Values("state", x), Values("input", clipped), Values("parameter", p)
        after, out = self.checked_step(*arguments)
        check_constants(self, after, out)
        return Trace(
            tracer,
            [*u.values()],
            {o.name: tracer.lift(out[o.name]) for o in self.outputs},
            [(p[d.name], d.default, d.meaning) for d in self.params],
            [(x[s.name], s.initial, tracer.lift(after[s.name])) for s in self.states],
            {i.name: i.source_format.frac for i in self.inputs if i.source_format is not None},
        )

    def checked_step(
        self, x: Any, u: Any, p: Any, *, arrays: bool = False
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Call `step`; errors in it become one line (`model.step.checked`)."""
        where = placed(self._line, f"estimator {self.name}")
        fix = "write it: it gets states, inputs, parameters and returns {states}, {outputs}"
        written = type(self).step is not Estimator.step
        require(written, where, "a method step(self, x, u, p)", None, fix)
        return checked(self, x, u, p, arrays=arrays)


def check_attributes(estimator: Estimator, cls: type[Estimator]) -> None:
    """Refuse attributes that are not of the kind which the annotations of ``cls`` say."""
    where = placed(estimator._line, f"estimator {estimator.name}")
    for name, annotation in inspect.get_annotations(cls).items():
        check_kind(where, name, getattr(estimator, name), annotation)


def _check_name(where: str, kind: str, name: Any) -> None:
    valid = isinstance(name, str) and name.isidentifier() and not iskeyword(name)
    wanted = f"{kind} names of letters, digits and _, no words of Python"
    require(valid, where, wanted, name, "rename it")


def input_words(program: Program, inputs: FloatArray) -> IntArray:
    """Quantise real inputs (..., n_inputs, runs) to the program's input words (saturating)."""
    words = np.empty(inputs.shape, dtype=np.int64)
    for k, number in enumerate(program.inputs):
        words[..., k, :] = program.format(number).quantise(inputs[..., k, :])
    return words


def param_words(program: Program, values: Mapping[str, float]) -> dict[int, int]:
    """Words of the parameters, by value number."""
    return {
        n: int(program.format(n).quantise(values[program.values[n].name]))
        for n in program.of_kind(Kind.PARAM)
    }


def with_params(
    program: Program, estimator: Estimator, params: Mapping[str, float] | None
) -> Program:
    """Return the program with these initial values of its parameter registers."""
    values = list(program.values)
    for number, word in param_words(program, estimator.param_values(params)).items():
        values[number] = replace(values[number], initial=word)
    return replace(program, values=tuple(values))
