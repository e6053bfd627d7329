"""Demands on figures, the choice, and what comes nearest."""

import pytest

from boresight.model.errors import InputError
from boresight.sim.explore.demands import chosen, demands_of, with_tolerance
from boresight.sim.explore.figures import FIGURES, ErrorFigures, Explored, Quantity

KNOWN = [Quantity("angle", "angle", "ht"), *FIGURES]
LUT, CLOCK = ((next(q for q in FIGURES if q.name == name)) for name in ("lut", "clock"))


def row(word: int, error: float | None, lut: int, dsp: int, **more) -> Explored:
    errors = {"angle": ErrorFigures("ht", error, 0.0, 1e-3)}
    return Explored("e", {}, word, "small", "xc6slx9", errors=errors, lut=lut, dsp=dsp, **more)


ROWS = [
    row(18, 1e-2, 300, 1, clock=130.0),
    row(24, 1e-4, 370, 4, clock=120.0),
    row(32, 1e-6, 480, 4, clock=125.0),
    row(20, 1e-9, 1, 1, refused="no"),
    row(22, 1e-9, 2, 1, fits=False),
    row(23, None, 3, 1),
]


def test_units_are_converted() -> None:
    first, second = demands_of("angle<0.018deg, dsp <= 1", KNOWN)
    assert first.limit == pytest.approx(1e-4) and first.quantity.unit == "ht"
    assert str(second) == "dsp<=1" and second.meets(1.0) and not first.meets(first.limit)
    assert demands_of("", KNOWN) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "angel<1",
            "want: wanted one of 17 names, nearest: angle, .*; choose one; docs/learn/explore",
        ),
        ("angle=1", "wanted demands as angle<0.01ht, dsp<=1"),
        ("angle<1e", "wanted demands as"),
        ("angle<inf", "wanted demands as"),
        ("angle<1 s", "wanted a unit of angle, ht"),
        ("dsp<1 deg", "a plain number"),
    ],
)
def test_bad_demands(text, message) -> None:
    with pytest.raises(InputError, match=message) as error:
        demands_of(text, KNOWN)
    assert "\n" not in str(error.value)


def test_the_least_of_those_that_meet_all() -> None:
    demands = demands_of("angle<1e-3", KNOWN)
    assert chosen(ROWS, demands, LUT).row is ROWS[1]
    assert chosen(ROWS, demands, CLOCK).row is ROWS[2]  # more is better
    assert chosen(ROWS, [], LUT).row is ROWS[5], "without a demand on the error"
    (line,) = chosen(ROWS, demands, LUT).lines(LUT)
    assert line == "choice, lut 370: 24 bits, small, xc6slx9"


@pytest.mark.parametrize(
    ("text", "limits"),
    [
        ("", {"tolerance": 1.0}),
        ("dsp<=1", {"tolerance": 1.0, "dsp": 1.0}),
        ("angle<1", {"angle": 1.0}),
        ("tolerance<5", {"tolerance": 5.0}),
    ],
)
def test_tolerances_count_unless_a_demand_speaks_of_an_error(text, limits) -> None:
    demands = demands_of(text, KNOWN)
    assert {d.quantity.name: d.limit for d in with_tolerance(demands, KNOWN)} == limits
    judged = [q for q in KNOWN if q.name != "tolerance"]
    if "tolerance" not in text:
        assert with_tolerance(demands, judged) == demands


def test_what_comes_nearest_and_what_to_relax() -> None:
    choice = chosen(ROWS, demands_of("angle<1e-3, dsp<=1", KNOWN), LUT)
    assert choice.row is None and choice.nearest is ROWS[1]  # four times dsp; else ten the angle
    assert [d.quantity.name for d in choice.missed] == ["dsp"]
    assert [(r.demand.quantity.name, r.limit, r.row) for r in choice.relaxed] == [
        ("angle", 1e-2, ROWS[0]),
        ("dsp", 4, ROWS[1]),
    ]
    lines = choice.lines(LUT)
    assert "dsp is 4, wanted <= 1" in lines[0]
    assert lines[1].startswith("angle<0.001ht relaxed to 0.01 ht alone would do: 18 bits")


def test_the_clock_that_a_missed_deadline_takes() -> None:
    rows = [row(24, 1e-4, 370, 4, cycles=260, us=2.6, clock=128.4, clock_is="estimate")]
    lines = chosen(rows, demands_of("us<2", KNOWN), LUT).lines(LUT)
    clock = "a clock of 130.0 MHz (its own: 128.4 MHz, estimate)"
    assert lines[0].endswith(f"us is 2.6, wanted < 2, which takes {clock}")
    assert lines[1].startswith(f"us<2 relaxed to 2.6 alone would do, or {clock}: 24 bits")
    (rate,) = demands_of("rate>=0.4MHz", KNOWN)
    assert rate.clock(row(24, 1e-4, 370, 4, interval=250)) == "a clock of 100.0 MHz"
    assert not demands_of("dsp<1", KNOWN)[0].clock(rows[0])


def test_nothing_is_known_yet() -> None:
    demands = demands_of("us<5", KNOWN)
    assert chosen(ROWS, demands, LUT).lines(LUT)[0].startswith("nothing meets the demands: no")
