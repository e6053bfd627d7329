"""Lists of cases, each one change of every log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce

from boresight.model.declarations import GRAVITY
from boresight.model.errors import require_choice
from boresight.sim.attitude.robustness.variants import (
    Variant,
    biased,
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
from boresight.sim.records.nine_axis import NineAxis

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
    def chained(log: NineAxis) -> NineAxis:
        return reduce(lambda changed, one: one(changed), work, log)

    return Case(name, name, chained, judged, full_scale)


def _full() -> list[Case]:
    cases = [
        _case("as recorded"),
        _case("starts in motion", cut_in_motion),
        _case("in motion, bias 0.7 deg/s", cut_in_motion, biased),
        _case("bias 0.7 deg/s", biased),
        _case("third of the rate", partial(slower, factor=3.0)),
    ]
    for k in range(PLACES):
        cases.append(Case(f"cut at place {k}", "starts anywhere", partial(cut_in_motion, place=k)))
    cases += [
        _case("in motion, bias 1 deg/s", cut_in_motion, partial(biased, scale=2.0**0.5)),
        _case("bias warms up to 0.7 deg/s", warming),
        *(_case(f"{rate:g} Hz", partial(resampled, rate_hz=rate)) for rate in RATES_HZ),
        _case("field x 1.1", partial(scaled_field, factor=1.1)),
        _case("field x 0.9", partial(scaled_field, factor=0.9)),
        *(
            Case(
                f"field offset 10 %, way {k}",
                "field offset 10 %",
                partial(hard_iron, share=0.1, draw=k),
            )
            for k in range(WAYS)
        ),
        _case("magnetometer at 10 Hz", partial(magnetometer_at, rate_hz=10.0)),
        _case("no field for a minute", partial(without_field, seconds=60.0)),
        _case("never a field", without_field, judged="inclination"),
        _case("accelerometer of 4 g", partial(clipped, limit=4.0 * GRAVITY)),
        _case("gaps in the samples", gaps),
        _case("noise x 3", noisier),
        *(
            _case(
                f"{name} clipped at {share:g}",
                partial(clipped_to_share, sensor=key, share=share),
                full_scale=(key,),
            )
            for name, key in (("gyro", "gyr"), ("accelerometer", "acc"))
            for share in CLIPPED
        ),
        _case("fast turns", fast_turns, full_scale=("gyr",)),
        _case("sensors as they come", uncalibrated),
    ]
    for k in range(len(mountings())):
        cases.append(Case(f"mounting {k}", "mounted 24 ways", partial(mounted, number=k)))
    return cases


def _short() -> list[Case]:
    names = ("as recorded", "bias 0.7 deg/s", "cut at place 0", "never a field", "mounting 13")
    return [case for case in _full() if case.name in names]


#: Lists of cases by name.
LISTS: dict[str, Callable[[], list[Case]]] = {"full": _full, "short": _short}


def cases_of(name: str) -> list[Case]:
    """Return a list of cases: full has every case, short five.

    Raises
    ------
    InputError
        No such list.
    """
    require_choice("--cases", name, LISTS)
    return LISTS[name]()
