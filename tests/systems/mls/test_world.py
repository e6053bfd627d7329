"""The closed loop: what the phases send to the receiver decides which beams are asked for next."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import Loop, close_loop
from boresight.systems.mls.phases import Array, ArrayPhases
from boresight.systems.mls.world import SCANS, Landing


def fly(world: Landing) -> Loop:
    program = ArrayPhases(world.array.elements, "xyz"[world.array.axis])
    with make_level("c", Build(program)) as level:
        return close_loop(world, level)


@pytest.mark.parametrize("antenna, truth, scans", [("azimuth", -20.0, 12), ("elevation", 6.0, 36)])
def test_the_beam_stays_on_the_receiver(antenna: str, truth: float, scans: int) -> None:
    """Found by a scan of the sector, then followed; without compensation it wanders by degrees."""
    errors = {}
    place = {"azimuth_deg": -20.0, "elevation_deg": 6.0, "antenna": antenna}
    for compensated in (True, False):
        world = Landing(
            *("rolling", 3), **place, elements=16, seconds=2.2, beams=41, compensated=compensated
        )
        loop = fly(world)
        assert not loop.outputs["status"].any()
        assert len(world.angles) >= scans or not compensated
        errors[compensated] = np.abs(np.array(world.angles) - truth).max()
    assert errors[True] < 0.5 and errors[False] > 2.0


@pytest.mark.parametrize(
    "antenna, t0_us, widest_us", [("azimuth", 6800, 13000), ("elevation", 3350, 3500)]
)
def test_received_waveform(antenna: str, t0_us: float, widest_us: float) -> None:
    """ICAO Annex 10, 3.11.4.5.1; pulses to and fro merge where a scan turns without a pause."""
    scan = SCANS[antenna]
    apart = [1e6 * (fro - to) for to, fro in map(scan.times, (0.0, scan.low))]
    assert apart == pytest.approx([t0_us, widest_us])
    array, angles = Array(64, axis=scan.axis), np.linspace(scan.low, scan.high, 3101)
    phases = 0.5 * np.sin(np.radians(angles))[:, None] * np.arange(64)
    for inside, pulses in ((0.2, 1), (5.0, 2)):
        e = np.zeros(3)
        e[scan.axis] = np.sin(np.radians(scan.high - inside))
        amplitude = np.abs(array.field(phases, e))
        _, at_once = replace(scan, pause=0.0).waveform(angles, amplitude)
        assert (np.diff((at_once > np.sqrt(0.5)).astype(int)) == 1).sum() == pulses
        time, amplitude = scan.waveform(angles, amplitude)
        assert (np.diff(time) >= 0.0).all()
        late = time > time[-1] / 2.0
        to, fro = (time[half][amplitude[half].argmax()] for half in (~late, late))
        assert scan.angle(to, fro) == pytest.approx(scan.high - inside, abs=0.05)


def test_a_pulse_that_the_end_of_the_scan_cuts_gives_no_angle() -> None:
    """Half of a beam of 64 elements is 1.6 deg wide at 60 deg, where the scan ends at 62."""
    for azimuth, found in ((59.5, True), (61.0, False)):
        world = Landing("sea_5", 1, azimuth, seconds=1.9)
        fly(world)
        assert len(world.angles) > 5 if found else not world.angles
        assert np.abs(np.array(world.angles) - azimuth).max(initial=0.0) < 0.2


def test_beams_go_where_the_pulse_was() -> None:
    """The first scan covers the sector, then the gate is narrow and about the angle found."""
    world = Landing("sea_5", 2, 35.0, elements=16, seconds=1.6, beams=25)
    loop = fly(world)
    azimuth = np.degrees(np.arctan2(loop.inputs[:, 5], loop.inputs[:, 4]))
    assert (azimuth[0], azimuth[24]) == pytest.approx((-62.0, 62.0))
    assert np.abs(azimuth[75:] - 35.0).max() < 9.0
    assert np.ptp(azimuth[75:100]) == pytest.approx(16.0)
    lost = Landing("sea_5", 2, 35.0, elements=16, seconds=1.6, beams=25)
    lost.start()
    outputs = None
    for _ in range(60):  # an array without a beam: it goes on looking
        record = lost.record(outputs)
        outputs = {f"phase_{k}": (k * k % 7) / 7.0 for k in range(16)}
    assert record is not None and abs(lost._half) > 3.0 and not lost.angles
