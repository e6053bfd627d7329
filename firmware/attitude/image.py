"""Build of firmware for the soft core: from C sources to the words of its memory."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.model.tools.external import ToolFailed, failure
from boresight.model.tools.needs import NEEDS

#: Compiler and C library, as named by Debian and Ubuntu.
COMPILER = "riscv64-unknown-elf-gcc"
PACKAGES = NEEDS["riscv64 gcc"].packages

#: Warnings are errors. libm's functions set no errno and float arithmetic no flag that is read.
CFLAGS = (
    *("-std=c99", "-march=rv32im", "-mabi=ilp32", "-Wa,-march=rv32im_zicsr", "-ffreestanding"),
    *("-Wall", "-Wextra", "-Wconversion", "-Werror", "-fno-math-errno", "-fno-trapping-math"),
    *("-fno-strict-aliasing", "-fno-tree-loop-distribute-patterns", "-ffp-contract=off"),
    *("-ffunction-sections", "-fdata-sections"),
)
_LINK = (
    *("--specs=picolibc.specs", "-nostartfiles"),
    *("-Wl,--gc-sections", "-Wl,--no-warn-rwx-segments"),
)
_FIXED = ("start.S", "link.ld", "soc.h")


def source(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def find_cross_compiler() -> str:
    path, missing = shutil.which(COMPILER), COMPILER
    if path is not None:
        command = [path, "-print-file-name=picolibc.specs"]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        if Path(run.stdout.strip()).is_absolute():
            return path
        missing = f"picolibc for {COMPILER}"
    raise ToolMissing(
        f"{missing} was not found: install it (Debian, Ubuntu: apt-get install {PACKAGES})"
    )


def build_image(files: Mapping[str, str], *, sources: Sequence[str], ram: int) -> str:
    """Compile and link an image: its words for ``$readmemh``, from address 0.

    ``files`` are texts by file name, besides start-up, link script and ``soc.h``; ``sources`` the C
    files among them; ``ram`` bytes of memory.
    """
    compiler = find_cross_compiler()
    with tempfile.TemporaryDirectory(prefix="firmware-") as name:
        folder = Path(name)
        for file, text in {**{name: source(name) for name in _FIXED}, **files}.items():
            (folder / file).write_text(text, encoding="utf-8")
        size = f"-Wl,--defsym=RAM_SIZE={ram}"
        command = [compiler, *CFLAGS, "-Os", *_LINK, "-T", "link.ld", size, "start.S", *sources]
        _run([*command, "-lm", "-o", "image.elf"], folder)
        _run([f"{compiler.removesuffix('gcc')}objcopy", "-O", "binary", "image.elf", "bin"], folder)
        data = (folder / "bin").read_bytes()
    data += bytes(-len(data) % 4)
    words = (int.from_bytes(data[k : k + 4], "little") for k in range(0, len(data), 4))
    return "".join(f"{word:08x}\n" for word in words)


def _run(command: Sequence[str], folder: Path) -> None:
    completed = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if completed.returncode:
        raise ToolFailed(failure(f"{Path(command[0]).name} failed", completed.stderr))
