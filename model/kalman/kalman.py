"""A Kalman filter from its model: the author writes f, noise and measure, the rest is derived."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from boresight.model import declarations
from boresight.model.arrays import FloatArray
from boresight.model.declarations import Output
from boresight.model.errors import place_of_function, placed, require
from boresight.model.estimator import Estimator, SecondForm, Size, check_attributes
from boresight.model.kalman.declared import HELD, Attitude, Measurement, State, axes_of
from boresight.model.kalman.textbook import Textbook
from boresight.model.kalman.update import DITHER, Update, errors_of
from boresight.model.lowering.trace import Scalar, Trace
from boresight.model.recorded import evaluate
from boresight.model.step import check_arguments, check_number

#: Below one, so that the word spends no bit on one itself.
_BELOW = 1.0 - 2.0**-17
#: Optional parts of a model: a name that is nearly one of them is misspelt.
_WRITTEN = {"measure", "memory", "noise", "shown"}


class Kalman(Estimator):
    """Base class of a Kalman filter; extended where its model is not linear.

    A subclass declares `inputs`, `params` and `states`, and writes `f`, `noise` and `measure`.
    Derived are the Jacobians, P = F P F^T + Q over one half of P, and one update for each
    measurement, L = P h / sqrt(h^T P h + r), P - L L^T: equal to the update by all measurements at
    once, linearised at the predicted state. Ranges follow from the standard deviations alone: P_ij
    lies within sd_i sd_j of zero, L_i within sd_i. A variance near its largest is held: its row of
    F is the identity and its process noise is 0, so that P is still F P F^T + Q for some F.

    On the object, `states` has all states of the core: the author's (an attitude as its four
    components), those of `memory`, and P as ``p_A_B`` of two states A and B.

    Attributes
    ----------
    states : tuple of State or Attitude
        Estimated states.
    memory : tuple of boresight.State
        Further states that are not estimated; `f` returns their next values.
    outputs : tuple of Output
        Names of states, ``nis``, ``accepted`` and ``rejected`` (measurements of this update within
        and beyond their gates), or what `shown` returns; by default all states.
    prior : bool
        Whether outputs, except ``nis`` and the counts, are those of the predicted state, before
        the measurements of the update.
    initial_covariance : mapping of (str, str) to float
        Covariances of states at the start, by pairs of names; others are 0.
    floor : float
        Process noise added to each of n states for the rounding of P: n times this share of its
        largest variance. 2^-31 is the LSB of a 32-bit word.
    dither : bool
        Whether the predicted P is rounded at random, so that changes of less than an LSB in an
        update are right on average, at the cost of a product for each element. Float64 and words
        of less than 32 bits do not change.
    """

    states: tuple[Any, ...] = ()
    memory: tuple[declarations.State, ...] = ()
    prior: bool = False
    initial_covariance: Mapping[tuple[str, str], float] = {}
    floor: float = 2.0**-31
    dither: bool = False

    def __init__(self) -> None:
        check_attributes(self, Kalman)
        #: States as declared.
        self.estimated: tuple[State | Attitude, ...] = tuple(self.states)
        where = placed(self._line, f"estimator {self.name}")
        fix = "give it one, boresight.kalman.State(..., sd=0.5), or move it to memory"
        for s in self.estimated:
            place = placed(getattr(s, "line", self._line), f"state {getattr(s, 'name', s)}")
            found = f"{type(s).__module__.split('.')[0]} {type(s).__name__}"
            wanted = "a state with a standard deviation"
            require(isinstance(s, State | Attitude), place, wanted, found, fix)
        fix = 'declare them, as states = (State("pos", -100.0, 100.0, "m", sd=2.0),)'
        require(bool(self.estimated), where, "states to be estimated", self.estimated, fix)
        fix = "leave it out: the default is one LSB of a 32-bit word"
        require(0.0 <= self.floor < 1.0, f"{where}, floor", "a share from 0 to 1", self.floor, fix)
        if self.dither:
            self.memory += (declarations.State(DITHER, -1.0, 1.0, "ht", line=self._line),)
        #: Of each error state: its name, place and largest standard deviation.
        self.errors: list[str] = []
        self.places: list[str] = []
        initial_sd: list[float] = []
        self.largest_sd: list[float] = []
        states: list[declarations.State] = []
        #: Names of the error states that a name stands for.
        self.groups: dict[str, tuple[str, ...]] = {}
        for s in self.estimated:
            if isinstance(s, Attitude):
                names, sds, bounds = s.errors, s.sds, s.largest_sds
                pairs, line = zip(s.components, s.initial, strict=True), s.line
                states += [declarations.State(q, -1.0, 1.0, "", c, line=line) for q, c in pairs]
            else:
                names, sds, bounds = (s.name,), (s.sd,), (s.largest_sd,)
                states.append(s)
            self.groups[s.name] = tuple(names)
            self.errors += names
            self.places += [s.line] * len(names)
            self.largest_sd += [math.sqrt(_BELOW) * bound for bound in bounds]
            initial_sd += map(min, sds, self.largest_sd[-len(sds) :])
        #: States that are no attitudes.
        self.scalars = [s for s in self.estimated if isinstance(s, State)]
        self.groups |= axes_of([s.name for s in self.scalars])
        #: By the line of a measurement or of the prediction of a state: what its growth needs.
        self.remedies: dict[str, str] = {}
        self.sizes: list[Size] = []
        n = len(self.errors)
        #: Variances: beyond the first no element grows, the second is added in every update.
        self.variance_limits = [HELD * bound * bound for bound in self.largest_sd]
        self.noise_floor = [self.floor * n * bound * bound for bound in self.largest_sd]
        where = placed(self._line, f"initial_covariance of {self.name}")
        start = {(i, i): sd * sd for i, sd in enumerate(initial_sd)}
        for pair, value in self.initial_covariance.items():
            i, j = sorted(map(self.errors.index, errors_of(self, pair, where)))
            check_number(where, value)
            start[i, j] = value
        matrix = np.zeros((n, n))
        for (i, j), value in start.items():
            matrix[j, i] = value / (initial_sd[i] * initial_sd[j])
        positive = bool(np.linalg.eigvalsh(matrix)[0] >= -1e-6)  # of the lower triangle
        wanted = "covariances that are positive with the squares of sd"
        require(positive, where, wanted, self.initial_covariance, "lower them, or raise sd")
        self.covariance_states: dict[str, tuple[int, int]] = {}
        self.covariance_elements: dict[str, tuple[str, str]] = {}
        elements = []
        for (i, a), (j, b) in combinations_with_replacement(enumerate(self.errors), 2):
            name, bound = f"p_{a}_{b}", self.largest_sd[i] * self.largest_sd[j]
            self.covariance_states[name], self.covariance_elements[name] = (i, j), (a, b)
            low, first = 0.0 if i == j else -bound, start.get((i, j), 0.0)
            units = [unit for unit in (self.unit_of(i), self.unit_of(j)) if unit]
            unit = f"({units[0]})^2" if units and i == j else " ".join(units)
            elements.append(declarations.State(name, low, bound, unit, first, line=self.places[i]))
        self.states = (*states, *self.memory, *elements)
        if not self.outputs:
            self.outputs = tuple(Output(s.name, s.unit, line=s.line) for s in states)

    def unit_of(self, error: int) -> str:
        name = self.errors[error]
        return next((s.unit for s in self.scalars if s.name == name), "rad")

    # -- what the author writes -----------------------------------------------------------------

    def f(self, x: Any, u: Any, p: Any) -> Mapping[str, Any]:
        """Next values of the states that change, by name.

        For an attitude, the rotation in this update [rad, body axes], (3,). Vectors (`vector`) by
        their name or by component, and `memory`.

        Parameters
        ----------
        x : values by name
            States; vectors as arrays of three, attitudes as `AttitudeView`; elements of P as
            ``p_A_B``, without derivatives.
        u, p : values by name
            Inputs and parameters.
        """
        return {}

    def noise(self, x: Any, u: Any, p: Any) -> Mapping[Any, Any]:
        """Variances of the process noise of one update, by the name of a state; others have none.

        For a vector or an attitude, one for all components, or three. A pair of names as key is
        a covariance.
        """
        return {}

    def measure(self, x: Any, u: Any, p: Any) -> Sequence[Measurement]:
        """Measurements of the predicted states ``x``."""
        raise NotImplementedError

    def shown(self, x: Any, u: Any, p: Any) -> Mapping[str, Any]:
        """Further outputs, by name."""
        return {}

    # -- what follows ---------------------------------------------------------------------------

    def check_declarations(self) -> None:
        """See `Estimator`; a method ``measure``, and no name that is nearly one of `_WRITTEN`."""
        super().check_declarations()
        for name in ("f", "measure", "noise", "shown"):
            method = getattr(self, name)
            where = placed(place_of_function(method), f"{name} of {self.name}")
            check_arguments(where, name, method)
        where = placed(self._line, f"estimator {self.name}")
        written = type(self).measure is not Kalman.measure
        classes = [c for c in type(self).__mro__ if c not in Kalman.__mro__]
        names = {name for c in classes for name in vars(c)}
        for name in sorted(n for n in names if not hasattr(Kalman, n)):
            near = get_close_matches(name, _WRITTEN - names, 1, 0.8)
            fix = f"call it {''.join(near)}, or otherwise if it is something else"
            require(not near, where, f"names that are used, as {''.join(near)}", name, fix)
        fix = "write it: it returns a list of Measurement(z, h, r)"
        require(written, where, "a method measure(self, x, u, p)", None, fix)

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One update: predict, then correct. Numbers and arrays by the record, in float64."""
        if any(isinstance(v, Scalar) for v in vars(x).values()):
            return Update(self, x, u, p).results()
        trace, kinds = self._trace, (("input", u), ("param", p), ("state", x))
        leaves = {(kind, name): v for kind, values in kinds for name, v in vars(values).items()}
        results = evaluate(trace, leaves)
        after = {e.data[1]: results[next_e.number] for e, _, next_e in trace.states}
        return after, {name: results[e.number] for name, e in trace.outputs.items()}

    @cached_property
    def _trace(self) -> Trace:
        return self.trace()

    def textbook(
        self, inputs: FloatArray, params: Mapping[str, float] | None = None
    ) -> SecondForm | None:
        """See `Estimator`: with numerical Jacobians, all measurements at once, Joseph's form."""
        return replace(
            Textbook(self).run(inputs, params),
            as_built=lambda: Textbook(self, floor=True).run(inputs, params).outputs,
        )

    def error_covariance(
        self, states: Mapping[str, FloatArray], params: Mapping[str, float]
    ) -> tuple[tuple[str, ...], FloatArray] | None:
        """See `Estimator`: of the outputs that are scalar states, in their units."""
        units = {s.name: s.unit for s in self.states}
        own = (o.name for o in self.outputs if o.unit == units.get(o.name))
        names = tuple(name for name in own if name in self.errors)
        if not names:
            return None
        at = [self.errors.index(name) for name in names]
        full = {pair: states[name] for name, pair in self.covariance_states.items()}
        rows = [[full[min(i, j), max(i, j)] for j in at] for i in at]
        return names, np.moveaxis(np.array(rows), 2, 0)
