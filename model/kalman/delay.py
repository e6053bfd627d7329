"""Late measurements: h of the states at the time that they show, extrapolated backwards."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from boresight.model import ops
from boresight.model.errors import require
from boresight.model.kalman.declared import Attitude, Measurement, grouped
from boresight.model.kalman.update import checked_measurements, in_range, moved
from boresight.model.lowering.trace import Scalar
from boresight.model.places import placed
from boresight.model.step import Values

if TYPE_CHECKING:
    from boresight.model.kalman.kalman import Kalman


def measurements_of(kalman: Kalman, x: Any, u: Any, p: Any) -> list[Measurement]:
    """What ``measure`` returns of predicted states ``x``; z and h of a late one are those of then.

    Raises
    ------
    InputError
        As of `checked_measurements`; a delay without a known time step.
    """
    found = checked_measurements(kalman, kalman.measure(x, u, p))
    for delay in sorted({m.delay for m in found} - {0.0}):
        line = next(m.line for m in found if m.delay == delay)
        earlier = _earlier(kalman, x, u, p, delay, line)
        late = checked_measurements(kalman, kalman.measure(earlier, u, p))
        pairs = zip(found, late, strict=True)
        found = [replace(m, z=m2.z, h=m2.h) if m.delay == delay else m for m, m2 in pairs]
    return found


def _earlier(kalman: Kalman, x: Any, u: Any, p: Any, delay: float, line: str) -> Values:
    """States ``delay`` seconds ago; attitudes and memory are those of now.

    f with dt = -delay, if dt is an input. Otherwise by the middle of the interval, with the rate
    of change x'(x) = (f(x) - x) / dt, which is that of half a step later::

        x(t - d) = x - d x'(x - (d + dt)/2 x'(x))
    """
    scalars = [s for s in kalman.estimated if not isinstance(s, Attitude)]
    now = {s.name: getattr(x, s.name) for s in scalars}

    def moved_by(values: dict[str, Any], inputs: Any) -> dict[str, Any]:
        before = {**vars(x), **values}
        return moved(kalman, kalman.f(_seen(kalman, x, values), inputs, p), before)

    def ago(values: dict[str, Any], seconds: float) -> dict[str, Any]:
        after, steps = moved_by(values, u), seconds * rate
        out = {}
        for s in scalars:
            change = _change(after[s.name], values[s.name])
            change = ops.wrap_ht(change) if s.unit == "ht" else change
            out[s.name] = in_range(now[s.name] - steps * change, s)
        return out

    if any(i.name == "dt" for i in kalman.inputs):
        back = Values("input", {**vars(u), "dt": -delay})
        after = moved_by(now, back)
        return _seen(kalman, x, {s.name: in_range(after[s.name], s) for s in scalars})
    rate = kalman.rates_hz.get("dt", 0.0)
    fix = 'declare rates_hz = {"dt": 1.0 / DT} in the class, or an input dt'
    where = placed(line, "measurement, delay")
    require(rate > 0.0, where, "the time step of the model", None, fix)
    return _seen(kalman, x, ago(ago(now, 0.5 * (delay + 1.0 / rate)), delay))


def _seen(kalman: Kalman, x: Any, values: dict[str, Any]) -> Values:
    """The view ``x`` with other values of the scalar states."""
    scalars = [s for s in kalman.estimated if not isinstance(s, Attitude)]
    return Values("state", {**vars(x), **grouped(scalars, Values("state", values))})


def _change(after: Any, before: Any) -> Any:
    """After - before; a sum that has ``before`` as a term loses it, and keeps a narrow interval."""
    rest = _without(after, before)
    return after - before if rest is None else rest


def _without(total: Any, term: Any) -> Any:
    """A sum without one of its terms; None if it is not one."""
    if total is term:
        return 0.0
    if not isinstance(total, Scalar) or total.kind not in ("add", "sub"):
        return None
    a, b = total.args
    if (rest := _without(a, term)) is not None:
        return rest + b if total.kind == "add" else rest - b
    if total.kind == "add" and (rest := _without(b, term)) is not None:
        return a + rest
    return None
