"""The landing-system array: Figures 3 to 7 of the paper, with figures of our own."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.experiments.cases import Case, CasesExperiment
from boresight.sim.experiments.forms import run_forms, schedules_of
from boresight.sim.experiments.seeds import Runs
from boresight.sim.plotting import COLOUR, Section, figure_and_axes, legend, settings, svg
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate
from boresight.sim.rotations.zyx import angles_of, wrapped
from boresight.systems.mls.estimator import MlsAttitude
from boresight.systems.mls.phases import Array, ArrayPhases, direction, lobe
from boresight.systems.mls.world import RATE_HZ, SCANS, Deck, SensorErrors, deck, records

AZIMUTHS = {"m60": -60.0, "0": 0.0, "60": 60.0}  #: of receivers [deg], by name.
GLIDE_DEG = 3.0  #: elevation of receivers.
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STEP_DEG = 0.05  #: between beams of a scan.
_SCAN = SCANS["azimuth"]
_HIGH = 30.0  #: elevation at which Z is looked at as well.
_PULSES = (
    "Elements displaced along {} by b d N(0, 1), 64 elements, one draw: what receivers at -60, 0 "
    "and 60 deg get over time, a pulse while the beam goes to 62 deg and one while it comes back "
    "(bars), with a pause of 0.6 ms between."
)


def phases_of(array: Array, q: FloatArray, beams: FloatArray) -> FloatArray:
    """Phases (m, elements) of the core's program for attitudes and beams (m, 4), (m, 3)."""
    rows, params = np.concatenate([q, beams], axis=1), {"spacing": array.spacing}
    program = ArrayPhases(array.elements, "xyz"[array.axis])
    ((run,),) = run_forms(program, [rows], params=params, levels=("c",))
    return np.stack([run.outputs[f"phase_{k}"] for k in range(array.elements)], axis=1)


def patterns_of(
    array: Array, draws: int, seed: int
) -> tuple[dict[str, float], dict[str, tuple[FloatArray, FloatArray]]]:
    """Figures of pulses (`_figures`) and one draw's scan [deg] and amplitudes, by their names.

    A name has axis, b and azimuth (``x_05_m60``), at the higher elevation ``z_05_0_at_30``. The
    phases are those of the core for beams every `STEP_DEG`, the deck level.
    """
    scan = np.linspace(_SCAN.low, _SCAN.high, round(2.0 * _SCAN.half / STEP_DEG) + 1)
    figures, shown = dict[str, float](), {}
    for elevation in (GLIDE_DEG, _HIGH):
        phases = phases_of(array, np.tile(LEVEL, (len(scan), 1)), direction(scan, elevation))
        for axis, (k, b), (key, azimuth) in product(
            range(3), enumerate((0.1, 0.5)), AZIMUTHS.items()
        ):
            name, e = f"{'xyz'[axis]}_0{10 * b:.0f}_{key}", direction(azimuth, elevation)
            if elevation != GLIDE_DEG and name != "z_05_0":
                continue
            rng = np.random.default_rng([seed, axis, k, round(azimuth) % 360])
            q = array.displacements(axis, b, draws, rng)
            amplitude = np.abs(array.field(phases, e, q))
            name += "" if elevation == GLIDE_DEG else f"_at_{elevation:.0f}"
            values = _figures(array, scan, amplitude, azimuth).items()
            figures |= {f"{name}_{figure}": float(value) for figure, value in values}
            shown[name] = scan, amplitude[0]
    return figures, shown


def _figures(
    array: Array, scan: FloatArray, amplitude: FloatArray, azimuth: float
) -> dict[str, Any]:
    """What becomes of the pulse of a receiver at an azimuth, of amplitudes (draws, m).

    ``gain`` of the field where it is; ``width`` of the -3 dB gate and ``sd`` of the angle found
    [deg] of pulses at the right place; ``wrong``, the share of those elsewhere; median
    ``sidelobe_db`` beyond the first ones; ``merged``, the share whose pulses to and fro would be
    one, never 3 dB lower in between, if the beam turned without a pause.
    """
    # To the second null, so that the first side lobes are part of it.
    tilt = math.cos(math.radians(azimuth))
    main = math.degrees(2.0 / (array.elements * array.spacing * tilt))
    main_lobe = lobe(scan, amplitude, main)
    error = _SCAN.angle(*_SCAN.times(main_lobe.centre)) - azimuth
    right = np.abs(error) < main
    between = np.where(scan >= azimuth, amplitude, np.inf).min(axis=1)
    return {
        "gain": amplitude[:, np.abs(scan - azimuth).argmin()].mean(),
        **{"width": np.median(main_lobe.width[right]), "sd": error[right].std()},
        **{"wrong": 1.0 - right.mean(), "sidelobe_db": np.median(main_lobe.sidelobe_db)},
        "merged": (between > np.sqrt(0.5) * main_lobe.peak).mean(),
    }


def _pulses(patterns: Mapping[str, tuple[FloatArray, FloatArray]], axis: str) -> str:
    """Figures 3 to 5: what receivers at three azimuths get over time."""
    with settings():
        figure, grid = figure_and_axes(3.4, 2, 3, sharex=True, sharey=True)
        for row, b in zip(grid, (1, 5), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                time, amplitude = _SCAN.waveform(*patterns[f"{axis}_0{b}_{key}"])
                for at in _SCAN.times(azimuth):
                    axes.axvline(1e3 * at, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                axes.plot(1e3 * time, amplitude, color=COLOUR["heading"], linewidth=0.8)
                axes.set_title(f"{azimuth:g} deg, b = 0.{b}", fontsize=9)
                axes.set_ylim(0.0, 1.05)
        for axes in grid[1]:
            axes.set_xlabel("time, ms")
        return svg(figure, f"pulses-{axis}")


AXES = ("roll", "pitch", "heading")
ENCODER_DEG = 360.0 / 4096.0  #: step of 1024 lines, each edge counted.
SETTLED = 3000  #: records before which nothing is judged.
SECONDS = 10.0
FEW = 10  #: most runs of cases that only illustrate.
MOST_LAG = 20  #: ms that a lag is looked for.
LAG_CONTRAST = 1.1  #: least ratio of the spread at the largest lag to the smallest spread.
COMPARED = ("corrected", "picard_4", "bias", "rolling", "sea_5")  #: fixed with float.
_NOMINAL = SensorErrors()
_BIASED = {"errors": SensorErrors(gyro_bias=(0.0, 0.0, 0.0), bias_spread=0.2)}
_FOLLOWS = {"gyro_sd": 0.2}  # rad/s: the remainder of a bias of 0.2 deg/s is small
_ROLLING: dict[str, Any] = {"motion": "rolling", "steered": True}
_FREE = {"norm": "free", "innovation": "printed"}
_GYRO = {"scale": 1.0, "acc_sd": 64.0, "mag_sd": 512.0}  # R so large that nothing else counts
_ALL_RUNS = ("corrected", "gyro_only", "innovation_28", "rolling")

#: The filter as corrected and as printed, other sensors, other decks: options of `run_case`.
CASES = {
    "corrected": Case("as corrected, Picard of third order"),
    "picard_4": Case("Picard of fourth order, as (21)", options={"picard": 4}),
    "gyro_only": Case("gyro alone, once aligned", params=_GYRO),
    "lag_5ms": Case("gyro 5 ms late", {"errors": SensorErrors(gyro_lag=5)}),
    "process_18": Case("as printed (18), q' = -w q/2", options={"process": "printed"}),
    "measurement_24": Case("as printed (24), h = C V", options={"measurement": "printed"}),
    "innovation_28": Case("as printed (28), z - H q", options={"innovation": "printed"}),
    "norm_free": Case("q never set to norm one", options={"norm": "free"}),
    "norm_free_28": Case("(28), and q never set to norm one", options=_FREE),
    "bias": Case("gyro biases drawn, 0.2 deg/s each axis", _BIASED),
    "bias_follows": Case("gyro biases drawn, gyro_sd 11 deg/s", _BIASED, _FOLLOWS),
    "rolling": Case("ship turning by up to 10 deg about each axis", _ROLLING),
    "rolling_bias": Case("ship turning, biases drawn, 11 deg/s", {**_ROLLING, **_BIASED}, _FOLLOWS),
    **{
        f"sea_{n}": Case(f"carrier in sea state {n}", {"motion": f"sea_{n}", "steered": n > 4})
        for n in (4, 5, 6)
    },
}
_BEAMS = (
    "Azimuth antenna (above) and elevation antenna (below), receivers at azimuths of -60, 0 and 60 "
    "deg, 3 deg high (bars), the ship turned by up to 10 deg about each axis: pulses with phases "
    "of a level array, and of beams up to 3 deg away with phases turned by the filter's attitude."
)


class Mls(CasesExperiment):
    """Landing-system array on a moving deck, Wang Ding et al. (2018)."""

    estimator, step_s, at_once = MlsAttitude, 1.0 / RATE_HZ, 50
    cases, most_runs = CASES, {name: FEW for name in CASES if name not in _ALL_RUNS}
    intro = """
        Wang Ding et al. (2018) show pulses of a phased array whose elements are out of place
        (Figures 3 to 5), a quaternion Kalman filter on a turntable (6), and pulses after
        compensation (7), without numbers. Here are numbers, of the core's integer programs;
        {runs} runs, seeds {seed} to {last}.
    """
    columns = {
        **{f"{axis}, deg": f"{axis}_deg" for axis in (*AXES, "worst")},
        **{"largest, deg": "max_deg", "from the encoder, deg": "encoder_deg"},
        **{"fixed less float, deg": "fixed_float_rms_deg", "most, deg": "fixed_float_deg"},
        **{"saturated words": "saturated", "norm of q": "norm"},
    }
    shown = ("corrected", "lag_5ms")
    shown_text = (
        "Figure 6: encoder of 1024 lines (0.088 deg) and filter, and the error. Every 1.5 s an "
        "axis jumps by 8 deg in 60 ms."
    )

    def run_case(self, name: str, seeds: range) -> Runs:
        """Figures of each run after three seconds, if ``steered`` of its beams too.

        Kept of each run: spread of the error for each delay (lags, 3).
        """
        case = self.cases[name]
        decks, q, figures = flown(case, seeds, **case.world)
        truth = np.degrees(np.stack([d.euler for d in decks], axis=1))
        error = wrapped(np.degrees(angles_of(q)) - truth, 360.0)
        angles, late, n = truth + error, error[SETTLED:], len(truth)
        # The delay at which the truth explains the estimate best, but for a constant error.
        delayed = (truth[MOST_LAG - lag : n - lag] for lag in range(MOST_LAG))
        spread = np.stack([(angles[MOST_LAG:] - d).std(axis=0) for d in delayed], axis=1)
        encoder = ENCODER_DEG * np.round(truth / ENCODER_DEG)
        figures |= {f"{axis}_deg": _rms(late[:, :, k], 0) for k, axis in enumerate(AXES)}
        figures["max_deg"] = np.abs(late).max(axis=(0, 2))
        figures["encoder_deg"] = _rms(wrapped(angles - encoder, 360.0)[SETTLED:], (0, 2))
        panels: dict[Any, Any] = {"angle, deg": {}, "error, deg": {}}
        for k, axis in enumerate(AXES):
            panels["angle, deg"] |= {axis: angles[:, 0, k], f"{axis}, encoder": encoder[:, 0, k]}
            panels["error, deg"][axis] = error[:, 0, k]
        if case.world.get("steered"):
            panels = {}  # of Figure 7
            for antenna, (key, azimuth) in product(SCANS, AZIMUTHS.items()):
                after, before, panels[antenna, key] = beam_errors(decks, q, antenna, azimuth)
                figures[f"{antenna}_{key}_deg"] = _rms(after, 1)
                figures[f"uncompensated_{antenna}_{key}_deg"] = _rms(before, 1)
        return Runs(figures, panels, [*spread])

    def further(
        self, outcomes: Mapping[str, Runs], *, seed: int, runs: int, say: Callable[[str], None]
    ) -> dict[str, float]:
        """Worst axis and lag of each case, patterns, cycles of the programs in one core.

        Four patterns for each run, at least 40. No lag where the motion is too slow to show it.
        """
        figures = {"phases_fixed_float_turns": max(phases_fixed_float(seed, a) for a in "yz")}
        pooled = {name: case_runs.pooled() for name, case_runs in outcomes.items()}
        for name, of in pooled.items():
            figures[f"mls_{name}_worst_deg"] = max(of[f"{axis}_deg"] for axis in AXES)
            spread = np.mean(outcomes[name].each, axis=0)
            if (spread[-1] > LAG_CONTRAST * spread.min(axis=0)).all():
                figures[f"mls_{name}_lag_ms"] = float(spread.argmin(axis=0).max())
        figures |= {f"mls_{axis}_deg": pooled["corrected"][f"{axis}_deg"] for axis in AXES}
        figures["mls_fixed_float_deg"] = max(pooled[n]["fixed_float_deg"] for n in COMPARED)
        for elements in (16, 64):  # the plots are those of 64
            say(f"patterns of {elements} elements")
            some, self.patterns = patterns_of(Array(elements), 4 * max(runs, FEW), seed)
            figures |= {f"array{elements}_{name}": value for name, value in some.items()}
        for config, parts in schedules_of(
            MlsAttitude(), ArrayPhases(), ArrayPhases(axis="z")
        ).items():
            for name, schedule in zip(("mls", "phases64", "phases64_z"), parts, strict=True):
                figures[f"{name}_interval_cycles_{config}"] = float(schedule.interval)
        return figures

    def sections(self, outcomes: Mapping[str, Runs]) -> list[Section]:
        pulses = [(_PULSES.format(axis.upper()), _pulses(self.patterns, axis)) for axis in "xyz"]
        beams = [("", _beams(outcomes["rolling"].shown))]
        return [
            Section(title="Figures 3 to 5: elements out of place", figures=pulses),
            Section(title="Figure 7: compensation", text=_BEAMS, figures=beams),
        ]


def flown(
    case: Case,
    seeds: Sequence[int],
    motion: str = "table",
    errors: SensorErrors = _NOMINAL,
    steered: bool = False,
) -> tuple[list[Deck], FloatArray, dict[str, FloatArray]]:
    """Decks, quaternions (n, runs, 4) by the integer C, and figures of fixed point."""
    decks = [deck(motion, SECONDS, seed) for seed in seeds]
    rows = np.stack([records(d, s, errors) for d, s in zip(decks, seeds, strict=True)], axis=1)
    c, real = run_forms(MlsAttitude(**case.options), rows.swapaxes(0, 1), params=case.params)
    pairs = zip(c, real, strict=True)
    difference = np.array([[r.outputs[a] - f.outputs[a] for a in AXES] for r, f in pairs])
    error = 180.0 * wrapped(difference, 2.0)[:, :, SETTLED:]
    figures = {
        "fixed_float_deg": np.abs(error).max(axis=(1, 2)),
        "fixed_float_rms_deg": _rms(error, (1, 2)),
        "saturated": np.array([float(r.n_saturated) for r in c]),
        "norm": np.array([r.outputs.get("norm", [1.0])[-1] for r in c]),
    }
    q = np.stack([attitude_of(r.outputs) for r in c], axis=1)
    return decks, q, figures


def _rms(x: FloatArray, axis: int | tuple[int, ...]) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(x**2, axis=axis)))


def phases_fixed_float(seed: int, axis: str) -> float:
    """Largest difference of the core's phases from float64 [turns], at any attitude."""
    rng = np.random.default_rng([seed, 64])
    parts = [rng.normal(size=(4000, n)) for n in (4, 3)]
    u = np.concatenate([x / np.linalg.norm(x, axis=1, keepdims=True) for x in parts], axis=1)
    (c,), (real,) = run_forms(ArrayPhases(axis=axis), [u])
    apart = [c.outputs[n] - real.outputs[n] for n in c.outputs if n != "status"]
    return float(np.abs(wrapped(apart, 1.0)).max())


def beam_errors(
    decks: Sequence[Deck], q: FloatArray, antenna: str, azimuth_deg: float
) -> tuple[FloatArray, FloatArray, tuple[tuple[FloatArray, FloatArray], ...]]:
    """Error of a receiver's angle at one of `SCANS` (runs, 24 instants) [deg], by -3 dB gates.

    With phases turned by the estimated attitude ``q``, and with those of a level array; then scan
    [deg] and amplitude of both, level first, at the last instant of the first run.
    """
    scan = SCANS[antenna]
    array, place = Array(axis=scan.axis), {"azimuth": azimuth_deg, "elevation": GLIDE_DEG}

    def beams_at(angles: FloatArray) -> FloatArray:
        to = place | {antenna: angles}
        return direction(to["azimuth"], to["elevation"])

    at = np.linspace(SETTLED, len(q) - 1, 24).astype(int)
    wide = np.linspace(scan.low, scan.high, round(10.0 * scan.half / 2.0) + 1)
    narrow = place[antenna] + np.linspace(-3.0, 3.0, 61)
    fixed = phases_of(array, np.tile(LEVEL, (len(wide), 1)), beams_at(wide))
    beams = np.tile(beams_at(narrow), (len(at), 1))
    level, steered = [], []
    for run, motion in enumerate(decks):
        receiver = rotate(quaternion_conjugate(motion.q[at]), direction(azimuth_deg, GLIDE_DEG))
        turned = phases_of(array, q[at, run].repeat(len(narrow), axis=0), beams)
        level.append(np.abs(array.field(fixed, receiver)))
        fields = map(array.field, np.split(turned, len(at)), receiver)
        steered.append(np.abs(np.stack(list(fields))))
    before, after = (
        lobe(angles, np.stack(amplitudes), 2.0).centre - place[antenna]
        for angles, amplitudes in ((wide, level), (narrow, steered))
    )
    return after, before, ((wide, level[0][-1]), (narrow, steered[0][-1]))


def _beams(pulses: Mapping[Any, Any]) -> str:
    """Figure 7: pulses of both antennas with and without compensation."""
    with settings():
        figure, grid = figure_and_axes(4.4, len(SCANS), 3, sharey=True)
        for row, (antenna, scan) in zip(grid, SCANS.items(), strict=True):
            row[0].set_ylabel("amplitude")
            for axes, (key, azimuth) in zip(row, AZIMUTHS.items(), strict=True):
                middle = azimuth if antenna == "azimuth" else GLIDE_DEG
                axes.axvline(middle, color=COLOUR["amber"], linewidth=2.5, alpha=0.5)
                styles = ("grey", "level array"), ("heading", "compensated")
                for pulse, (name, label) in zip(pulses[antenna, key], styles, strict=True):
                    axes.plot(*pulse, color=COLOUR[name], label=label)
                low, high = max(middle - 18.0, scan.low - 2.0), min(middle + 18.0, scan.high + 2.0)
                axes.set(xlabel=f"{antenna}, deg (receiver at {azimuth:g} deg)", xlim=(low, high))
        legend(grid[0][0], 2)
        return svg(figure, "beams")
