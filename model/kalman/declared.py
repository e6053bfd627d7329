"""What the author of a Kalman filter declares: states with standard deviations, measurements."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any, TypeVar

import numpy as np

from boresight.model import declarations, ops
from boresight.model.declarations import check_kind
from boresight.model.errors import author_line, placed, require, require_choice
from boresight.model.step import check_number
from boresight.model.units import is_square, same_unit

#: Last letters of the components of a vector.
AXES = ("xyz", "enu", "ned")
#: What `spread` spreads that is one number for each component.
NEXT = "next values"
#: Least standard deviation, whose square is a number.
_LEAST = 2.0**-200
#: Largest standard deviation by default, as a multiple of the initial one, and as advised, of that
#: of a log.
RESERVE = 1.2
#: Share of its largest at which a variance grows no more.
HELD = 0.75
_D = TypeVar("_D")
_LINE: Any = field(default_factory=author_line, kw_only=True, repr=False, compare=False)


@dataclass(frozen=True)
class State(declarations.State):
    """A scalar state of a Kalman filter.

    InputError: as of `boresight.State`; no standard deviation, or ``sd_max`` below it.

    Parameters
    ----------
    name, low, high, unit, initial
        As of `boresight.State`. A state in ``ht`` is an angle, which wraps.
    sd : float
        Standard deviation at the start, in ``unit``.
    sd_max : float, optional
        Largest standard deviation, by default 1.2 ``sd``. It determines the formats of P. A
        variance above three quarters of its square is held until a measurement reduces it.
    """

    sd: float = math.nan
    sd_max: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        where = placed(self.line, f"state {self.name}")
        check_kind(where, "name", self.name, "str")
        _check_sd(where, (self.sd,), (self.largest_sd,))

    @property
    def largest_sd(self) -> float:
        return RESERVE * self.sd if self.sd_max is None else self.sd_max


@dataclass(frozen=True)
class Attitude:
    """A unit quaternion, body to navigation, whose error is a small rotation of three components.

    True and estimated attitude differ by a rotation e in navigation axes, C_true = (1 + [e x]) C.
    The methods of a filter read it as an `AttitudeView`. For the name ``q`` its states are ``qw,
    qx, qy, qz``; its errors, in P and in messages, ``q_e, q_n, q_u``.

    Parameters
    ----------
    name : str
    sd, sd_max : (3,) or float
        Standard deviations of the components of e, rad: initial and largest.
    initial : (4,)
        The quaternion, scalar first.
    """

    name: str
    sd: Sequence[float] | float = math.nan
    sd_max: Sequence[float] | float | None = None
    initial: Sequence[float] = (1.0, 0.0, 0.0, 0.0)
    line: str = _LINE

    def __post_init__(self) -> None:
        where = placed(self.line, f"attitude {self.name}")
        check_kind(where, "name", self.name, "str")
        for name, n in (("sd", 3), ("sd_max", 3), ("initial", 4)):
            given = getattr(self, name)
            numbers = [*given] if np.iterable(given) else [given] * 3
            good = len(numbers) == n and all(isinstance(number, Real) for number in numbers)
            good = good and not any(abs(number) > 1.0 / _LEAST for number in numbers)
            good = good or (given is None and name == "sd_max")
            require(good, where, f"{name} of {'1 or ' * (n == 3)}{n} numbers", given)
        _check_sd(where, self.sds, self.largest_sds)
        unit = abs(math.hypot(*self.initial) - 1.0) < 1e-6
        wanted = "a unit quaternion w, x, y, z as initial"
        require(unit, where, wanted, self.initial, "divide it by its norm")

    @property
    def sds(self) -> tuple[float, ...]:
        return _triple(self.sd)

    @property
    def largest_sds(self) -> tuple[float, ...]:
        largest = tuple(RESERVE * sd for sd in self.sds)
        return largest if self.sd_max is None else _triple(self.sd_max)

    @property
    def errors(self) -> tuple[str, ...]:
        return tuple(f"{self.name}_{a}" for a in "enu")

    @property
    def components(self) -> tuple[str, ...]:
        return tuple(self.name + c for c in "wxyz")


@dataclass(frozen=True, eq=False)
class Measurement:
    """A scalar measurement: z = h(x) + noise of variance r.

    Parameters
    ----------
    z : value
        Measured value: an input, or computed from inputs and states.
    h : value
        Value expected from the states; the derivative of h - z counts.
    r : value
        Variance of the noise, above 0 over the whole range of its parameters.
    valid : condition, optional
        Whether there is a measurement in this update; by default always.
    gate : float, optional
        Largest innovation in standard deviations; beyond it the measurement is rejected.
    wrap : bool
        Whether z and h are angles in half turns; implied by the unit ``ht``, `ops.wrap_ht` and
        `ops.atan2_ht`. If h is pi or 180 times such an angle, such as ``np.arctan2``, z, r and the
        largest values are converted.
    sd_max : float, optional
        Largest standard deviation of h. By default it follows from those of the states and the
        ranges of the derivatives. Not for an h that is a state, which has its own.
    slope_max : mapping of str to float
        Largest derivatives of h by states, powers of two. Larger derivatives are clamped: the
        measurement then corrects less.
    delay : float
        Age of the measurement, s. `f` extrapolates the states backwards to second order, with the
        current inputs; attitudes are the current ones. The model has an input ``dt``, or
        `rates_hz` of it.
    """

    z: Any
    h: Any
    r: Any
    valid: Any = None
    gate: float | None = None
    wrap: bool = False
    sd_max: float | None = None
    slope_max: Mapping[str, float] = field(default_factory=dict)
    delay: float = 0.0
    line: str = _LINE
    #: Half a turn in the author's unit, where z, h and r were converted to half turns.
    turn: float = field(default=1.0, kw_only=True, repr=False)

    def __post_init__(self) -> None:
        where = placed(self.line, "measurement")
        for part in fields(self):
            check_kind(where, part.name, getattr(self, part.name), str(part.type))
        gate = self.gate is None or 0.0 < self.gate <= 32.0
        wanted = "a gate above 0 and at most 32 standard deviations"
        require(gate, where, wanted, self.gate, "3 to 5 is usual")
        positive = self.sd_max is None or 0.0 < self.sd_max < math.inf
        fix = "leave it out, and it follows from the intervals"
        require(positive, where, "sd_max above 0", self.sd_max, fix)
        late, fix = 0.0 <= self.delay < math.inf, "a prediction needs no measurement"
        require(late, f"{where}, delay", "seconds, 0 or more", self.delay, fix)
        for name, slope in self.slope_max.items():
            check_kind(where, f"slope_max of {name}", slope, "float")
            positive = 0.0 < slope < math.inf
            larger = exponent(slope) if positive else 0
            wanted = f"a power of two as slope_max of {name}"
            fix = f"state the next larger one, 2**{larger}" if positive else "it is above 0"
            require(positive and slope == 2.0**larger, where, wanted, slope, fix)


def check_units(m: Measurement) -> None:
    """Refuse a measurement whose z, h and r are known to have units that do not belong together.

    InputError: h has another unit than z, or r another one than the square.
    """
    z, h, r = (_unit(value) for value in (m.z, m.h, m.r))
    where = placed(m.line, "measurement")
    fix = "declare both in one unit, or convert one of them in measure"
    require(not (z and h) or same_unit(z, h), f"{where}, h", f"the unit of z, {z}", h, fix)
    unit = z or h
    fix = "correct the unit of the variance, or convert it in measure"
    good = not (r and unit) or is_square(r, unit)
    require(good, f"{where}, r", f"the square of the unit of z and h, {unit}", r, fix)


def _unit(x: Any) -> str:
    """Unit of a recorded value; empty where it is unknown, or may be one of several."""
    chosen = getattr(x, "kind", "") == "select"
    units = {unit for unit, _ in ops.units_of(x)}
    return "" if chosen or len(units) != 1 else units.pop()


def vector(
    kind: Callable[..., _D], name: str, axes: str, *given: Any, **options: Any
) -> tuple[_D, ...]:
    """Three declarations whose names differ in the last letter.

    ``vector(Input, "a", "xyz", -50.0, 50.0, "m/s^2")`` declares ``ax``, ``ay`` and ``az``; a
    filter's methods see them also as the vector ``a``.
    """
    line = author_line()
    where, wanted = placed(line, f"vector {name}"), 'vector(Input, "a", "xyz", LOW, HIGH, UNIT)'
    require(isinstance(kind, type) and isinstance(name, str), where, wanted, (kind, name))
    require_choice(where, axes, AXES)
    return tuple(kind(name + a, *given, line=line, **options) for a in axes)


def axes_of(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Vectors among names: their common stem, and the names of the components."""
    stems = dict.fromkeys(name[:-1] for name in names if name[:-1].isidentifier())
    vectors = [(stem, tuple(stem + a for a in axes)) for stem in stems for axes in AXES]
    return {s: members for s, members in vectors if s not in names and {*members} <= {*names}}


def grouped(declared: Sequence[Any], values: Any) -> dict[str, Any]:
    """Values by name, and vectors of them as arrays of objects."""
    names = [d.name for d in declared]
    out = {name: getattr(values, name) for name in names}
    for stem, members in axes_of(names).items():
        out[stem] = np.array([out[m] for m in members], dtype=object)
    return out


def spread(
    given: Mapping[str, Any],
    groups: Mapping[str, Sequence[str]],
    where: str,
    quantity: str,
    kind: str = "state",
) -> dict[str, Any]:
    """Values by the name of each component, of values by names and by names of vectors.

    InputError: no mapping, an unknown name, another number of components, a value that is no
    number.
    """
    known = {m: (m,) for group in groups.values() for m in group} | {**groups}
    out: dict[str, Any] = {}
    wanted = f"a dictionary of {quantity} by the names of {kind}s"
    fix = "return {NAME: VALUE, ...}, {} if there are none"
    require(isinstance(given, Mapping), where, wanted, given, fix)
    for name, value in given.items():
        wanted = f"{quantity} of {kind}s: {', '.join(sorted(known))}"
        require(name in known, where, wanted, name, f"correct the name, or declare the {kind}")
        group = known[name]
        is_vector = isinstance(value, tuple | list | np.ndarray) and np.ndim(value) == 1
        values = list(value) if is_vector and name in groups else [value] * len(group)
        one = quantity == NEXT and len(group) > 1 and not is_vector
        wanted = f"{len(group)} components of {name}" if len(group) > 1 else "a number"
        fit = len(values) == len(group) and not one
        require(fit, where, wanted, value, f"give {', '.join(group)}")
        for member, number in zip(group, values, strict=True):
            check_number(f"{where}, {member}", number)
        out |= dict(zip(group, values, strict=True))
    return out


def exponent(x: float) -> int:
    """Exponent of the least power of two that is x or more; exact, unlike that of `math.log2`."""
    mantissa, power = math.frexp(x)
    return power - (mantissa == 0.5)


def upwards(x: float) -> float:
    """The next larger number of two digits."""
    unit = 10.0 ** (math.floor(math.log10(x)) - 1)
    return float(f"{math.ceil(x / unit * (1.0 - 1e-9)) * unit:.2g}")


def _triple(value: Sequence[float] | float) -> tuple[float, ...]:
    return tuple(value) if np.iterable(value) else (float(value),) * 3


def _check_sd(where: str, sds: Sequence[float], bounds: Sequence[float]) -> None:
    fix = "give the deviation at the start, such as sd=0.5; declare what is not estimated as "
    fix += "boresight.State in memory"
    wanted = "a standard deviation sd above 0, and none above sd_max"
    for sd, bound in zip(sds, bounds, strict=True):
        check_number(f"{where}, sd", sd)
        check_number(f"{where}, sd_max", bound)
        found = "no sd" if math.isnan(sd) else f"sd {sd:g}, sd_max {bound:g}"
        require(_LEAST < sd <= bound < 1.0 / _LEAST, where, wanted, found, fix)
