"""Data sets as logs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from boresight.model.errors import InputError
from boresight.sim.attitude.worlds.make_synthetic import synthetic_60s
from boresight.sim.data.convert_broad import broad_record, broad_trials
from boresight.sim.data.convert_ximu import convert, main
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
)
from tests.support.broad import trial

# -- `sim.data.convert_ximu` on a made-up recording whose every step is known ---------------------

TARE = quaternion_normalise([0.5, 0.1, -0.2, 0.8])
#: Sensor to (north, west, up) as the device's filter has it, before the tare.
TRUE = euler_to_quaternion(np.random.default_rng(5).uniform(-1, 1, size=(4, 3)))
#: Packet numbers: one inertial packet, a quaternion, then two to each quaternion.
INERTIAL = [10, 12, 13, 15, 16, 18, 19]
QUATERNION = [11, 14, 17, 20]
#: deg/s, g, gauss
READINGS = np.arange(63.0).reshape(7, 9) / 16
READINGS[3, 6:] = READINGS[2, 6:]
READINGS[5, 6:8] = READINGS[4, 6:8]


def write(folder: Path, kind: str, header: str, rows: np.ndarray) -> None:
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    (folder / f"00001_{kind}.csv").write_text("\n".join([header, *lines, ""]))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(
        tmp_path,
        "CalInertialAndMag",
        "Packet number,gx,gy,gz,ax,ay,az,mx,my,mz",
        np.column_stack([INERTIAL, READINGS]),
    )
    # what a tare does: earth turns by its inverse; what is sent: the conjugate
    shown = quaternion_conjugate(quaternion_multiply(quaternion_conjugate(TARE), TRUE))
    write(tmp_path, "Quaternion", "Packet number,w,x,y,z", np.column_stack([QUATERNION, shown]))
    registers = ["Packet number,Address,Value,Fixed-point value,Name", "1,0,10,NaN,Other"]
    registers += [f"2,{62 + k},0,{2 * float(TARE[k])!r},AlgorithmTareQuat{k}" for k in range(4)]
    (tmp_path / "00001_Registers.csv").write_text("\n".join(registers))
    return tmp_path


def made(folder: Path) -> NineAxis:
    return NineAxis.of(convert(folder))


def test_units_and_times(folder: Path) -> None:
    log = made(folder)
    np.testing.assert_array_equal(log.t, np.arange(6) / 256)
    np.testing.assert_allclose(log.gyr, np.radians(READINGS[1:, :3]), rtol=0, atol=5.1e-8)
    np.testing.assert_allclose(log.acc, READINGS[1:, 3:6] * 9.80665, rtol=0, atol=5.1e-6)
    new = log.mag_new
    np.testing.assert_allclose(log.mag[new], READINGS[1:, 6:][new] * 100, rtol=0, atol=5.1e-5)


def test_unchanged_field_is_not_new(folder: Path) -> None:
    # row 3 repeats all three axes of row 2; row 5 repeats two of row 4
    np.testing.assert_array_equal(made(folder).mag_new, [True, True, False, True, True, True])


def test_attitude_is_untared_and_points_from_sensor_to_enu(folder: Path) -> None:
    q = made(folder).q
    assert q is not None
    np.testing.assert_array_equal(np.isnan(q[:, 0]), [True, False, True, False, True, False])
    # x of NWU is y of ENU: a heading of 90 degrees on top
    expected = quaternion_multiply(euler_to_quaternion([0, 0, np.pi / 2]), TRUE[1:])
    sign = np.sign(np.sum(expected * q[1::2], axis=1, keepdims=True))
    np.testing.assert_allclose(q[1::2], sign * expected, rtol=0, atol=1e-7)


def test_main_writes_a_log_with_its_origin_on_top(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = folder / "out.csv"
    assert main([str(folder), str(out)]) == 0
    assert out.read_text().startswith("# x-IMU recording 00033 from scikit-kinematics 0.10.4")
    np.testing.assert_array_equal(NineAxis.of(read_record(out)).gyr, made(folder).gyr)
    assert main([str(folder)]) == 2
    assert capsys.readouterr().err.startswith("error: usage: ")
    assert main([str(folder / "none"), str(out)]) == 2
    assert capsys.readouterr().err.startswith("error: ")


def test_lost_packet_is_refused(folder: Path) -> None:
    path = folder / "00001_CalInertialAndMag.csv"
    lines = path.read_text().splitlines()
    del lines[4]
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"^.*: wanted two inertial packets .*, found a gap$"):
        made(folder)


@pytest.mark.parametrize("kind", ["CalInertialAndMag", "Quaternion", "Registers"])
def test_missing_and_double_files_are_named(folder: Path, kind: str) -> None:
    path = folder / f"00001_{kind}.csv"
    (folder / f"00002_{kind}.csv").write_bytes(path.read_bytes())
    with pytest.raises(InputError, match=rf"^.*: wanted one file \*_{kind}\.csv, found 2; .*$"):
        made(folder)
    (folder / f"00002_{kind}.csv").unlink()
    path.unlink()
    with pytest.raises(InputError, match=rf"^.*: wanted one file \*_{kind}\.csv, found 0; .*$"):
        made(folder)


def test_foreign_content_is_named(folder: Path) -> None:
    registers = folder / "00001_Registers.csv"
    registers.write_text(registers.read_text().replace("TareQuat2", "Other"))
    message = r"^.*Registers\.csv: wanted AlgorithmTareQuat0 to 3, found: 'AlgorithmTareQuat2'$"
    with pytest.raises(InputError, match=message):
        made(folder)
    quaternion = folder / "00001_Quaternion.csv"
    quaternion.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"^.*Quaternion\.csv: wanted 5 columns, found 2$"):
        made(folder)
    quaternion.write_text("a,b\n1,x\n")
    with pytest.raises(InputError, match=r"^.*Quaternion\.csv: wanted a table .*, found: .*$"):
        made(folder)


# -- A trial as BROAD stores it becomes a record, and what is none is refused ---------------------


def test_a_trial_becomes_a_record(tmp_path: Path) -> None:
    held = trial()
    savemat(tmp_path / "01_slow.mat", held)
    (path,) = broad_trials(tmp_path)
    log = NineAxis.of(broad_record(path))
    assert log.name == "01_slow"
    assert log.dt == pytest.approx(7.0 / 2000.0) and log.counts.sum() == 29
    for name, key in (("gyr", "imu_gyr"), ("acc", "imu_acc"), ("mag", "imu_mag")):
        assert getattr(log, name) == pytest.approx(held[key])
    assert log.attitude == pytest.approx(held["opt_quat"], nan_ok=True)


@pytest.mark.parametrize("name", ["imu_gyr", "sampling_rate", "movement"])
def test_what_is_no_trial_is_refused(name: str, tmp_path: Path) -> None:
    held = trial()
    if name == "movement":
        held[name] = np.zeros((7, 1))
    else:
        del held[name]
    savemat(tmp_path / "a.mat", held)
    with pytest.raises(InputError, match=r"a\.mat: wanted "):
        broad_record(tmp_path / "a.mat")


def test_any_bytes_are_a_trial_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, trial(), do_compression=True)
    whole, rng, refused = path.read_bytes(), np.random.default_rng(2), 0
    for _ in range(150):
        text = bytearray(whole)
        for at in rng.integers(0, len(text), 3):
            text[at] = rng.integers(256)
        path.write_bytes(text[: rng.integers(len(text))] if rng.random() < 0.3 else text)
        try:
            broad_record(path)
        except InputError:
            refused += 1
    assert refused > 100


def test_no_trial_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"BROAD's \.mat files"):
        broad_trials(tmp_path)


ARRAYS = ("t", "gyr", "acc", "mag", "mag_new", "q")


def test_bundled_file_is_up_to_date() -> None:
    new = NineAxis.of(synthetic_60s())
    old = NineAxis.of(read_record(bundled("synthetic_60s")))
    for key in ARRAYS:
        # sines differ in the last place between mathematics libraries
        np.testing.assert_allclose(
            getattr(old, key),
            getattr(new, key),
            rtol=0,
            atol=1e-11,
            err_msg="regenerate with: python -m boresight.sim.attitude.worlds.make_synthetic "
            "sim/data/synthetic_60s.csv",
        )


def test_documented_content() -> None:
    log = NineAxis.of(read_record(bundled("synthetic_60s")))
    assert len(log) == 6000
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 6000, 10))
