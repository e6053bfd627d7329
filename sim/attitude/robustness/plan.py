"""Lists of cases, each one change of every log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from boresight.model.declarations import GRAVITY
from boresight.model.errors import require_choice
from boresight.sim.attitude.robustness.variants import (
    Variant,
    biased,
    chain,
    clipped,
    clipped_to_share,
    cut_in_motion,
    fast_turns,
    gaps,
    hard_iron,
    magnetometer_at,
    mounted,
    mountings,
    noisier,
    resampled,
    scaled_field,
    slower,
    uncalibrated,
    warming,
    without_field,
)

__all__ = ["LISTS", "Case", "cases_of"]

#: Places at which a log is cut, at random, of the full list.
PLACES = 10
#: Directions of a hard-iron offset: one alone, for each trial, is chance.
WAYS = 3
#: Full scales, as shares of the largest value of the log.
CLIPPED = (0.8, 0.6)
#: Rates [Hz] of the full list, besides those of the logs.
RATES_HZ = (50.0, 100.0, 142.0, 286.0, 500.0, 1000.0)


@dataclass(frozen=True)
class Case:
    """One change of a log.

    Attributes
    ----------
    group : str
        Cases of a group are reported together, by their mean.
    judged : str
        The figure that counts: "total", or "inclination" where no sensor shows the heading.
    full_scale : tuple of str
        Sensors, "gyr" or "acc", whose largest component in the log is their full scale. The
        estimators learn it as from a board (`full_scale_params`).
    """

    name: str
    group: str
    work: Variant
    judged: str = "total"
    full_scale: tuple[str, ...] = ()


def _case(
    name: str, *work: Variant, judged: str = "total", full_scale: tuple[str, ...] = ()
) -> Case:
    return Case(name, name, chain(*work), judged, full_scale)


def _basic() -> list[Case]:
    """The most important cases."""
    return [
        _case("as recorded"),
        _case("starts in motion", cut_in_motion()),
        _case("in motion, bias 0.7 deg/s", cut_in_motion(), biased()),
        _case("bias 0.7 deg/s", biased()),
        _case("third of the rate", slower(3.0)),
    ]


def _full() -> list[Case]:
    cases = _basic()
    for k in range(PLACES):
        cases.append(Case(f"cut at place {k}", "starts anywhere", cut_in_motion(place=k)))
    cases += [
        _case("in motion, bias 1 deg/s", cut_in_motion(), biased(2.0**0.5)),
        _case("bias warms up to 0.7 deg/s", warming()),
        *(_case(f"{rate:g} Hz", resampled(rate)) for rate in RATES_HZ),
        _case("field x 1.1", scaled_field(1.1)),
        _case("field x 0.9", scaled_field(0.9)),
        *(
            Case(f"field offset 10 %, way {k}", "field offset 10 %", hard_iron(0.1, k))
            for k in range(WAYS)
        ),
        _case("magnetometer at 10 Hz", magnetometer_at(10.0)),
        _case("no field for a minute", without_field(60.0)),
        _case("never a field", without_field(), judged="inclination"),
        _case("accelerometer of 4 g", clipped(4.0 * GRAVITY)),
        _case("gaps in the samples", gaps()),
        _case("noise x 3", noisier()),
        *(
            _case(f"{name} clipped at {share:g}", clipped_to_share(key, share), full_scale=(key,))
            for name, key in (("gyro", "gyr"), ("accelerometer", "acc"))
            for share in CLIPPED
        ),
        _case("fast turns", fast_turns(), full_scale=("gyr",)),
        _case("sensors as they come", uncalibrated()),
    ]
    for k in range(len(mountings())):
        cases.append(Case(f"mounting {k}", "mounted 24 ways", mounted(k)))
    return cases


def _short() -> list[Case]:
    names = ("cut at place 0", "noise x 3", "magnetometer at 10 Hz", "never a field", "mounting 13")
    return _basic() + [case for case in _full() if case.name in names]


def _glance() -> list[Case]:
    names = ("as recorded", "bias 0.7 deg/s", "cut at place 0")
    return [case for case in _full() if case.name in names]


#: Lists of cases by name.
LISTS: dict[str, Callable[[], list[Case]]] = {"full": _full, "short": _short, "glance": _glance}


def cases_of(name: str) -> list[Case]:
    """Return a list of cases: full has every case, short some of each kind, glance three.

    Raises
    ------
    InputError
        No such list.
    """
    require_choice("--cases", name, LISTS)
    return LISTS[name]()
