"""The packages of the wheel: `boresight`, and below it the folders at the top of the repository."""

from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
FOLDERS = {"boresight": "boresight"} | {
    f"boresight.{name}": name for name in ("model", "gateware", "firmware", "sim", "systems")
}


def packages(package: str, folder: Path) -> list[str]:
    """A package and all packages below it, without what links lead to."""
    inner = (p for p in sorted(folder.iterdir()) if p.is_dir() and not p.is_symlink())
    below = (packages(f"{package}.{p.name}", p) for p in inner if p.name != "__pycache__")
    return [package, *(name for names in below for name in names)]


setup(
    package_dir=FOLDERS,
    packages=[name for package, f in FOLDERS.items() for name in packages(package, ROOT / f)],
)
