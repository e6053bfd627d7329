"""Build of firmware for the soft core: from C sources to the words of its memory."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from boresight.model.errors import ToolMissing
from boresight.model.tools.failure import ToolFailed, failure
from boresight.model.tools.needs import NEEDS

#: Compiler and C library, as named by Debian and Ubuntu.
COMPILER = "riscv64-unknown-elf-gcc"
PACKAGES = NEEDS["riscv64 gcc"].packages

#: Warnings are errors. libm's functions set no errno and float arithmetic no flag that is read.
CFLAGS = (
    "-std=c99",
    "-march=rv32im",
    "-mabi=ilp32",
    "-Wa,-march=rv32im_zicsr",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Werror",
    "-ffreestanding",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-strict-aliasing",
    "-fno-tree-loop-distribute-patterns",
    "-ffp-contract=off",
    "-ffunction-sections",
    "-fdata-sections",
)
_LINK = (
    "--specs=picolibc.specs",
    "-nostartfiles",
    "-Wl,--gc-sections",
    "-Wl,--no-warn-rwx-segments",
)
_FIXED = ("start.S", "link.ld", "soc.h", "soc.c")


class ImageError(ToolFailed):
    """The compiler or the linker failed."""


@dataclass(frozen=True)
class Image:
    """Firmware as words of memory.

    Attributes
    ----------
    words : tuple of int
        Memory from address 0.
    symbols : dict
        Addresses and numbers by name of the linker.
    ram : int
        Bytes of memory for which it was linked.
    """

    words: tuple[int, ...]
    symbols: dict[str, int]
    ram: int

    @property
    def hex(self) -> str:
        """Text for ``$readmemh``."""
        return "".join(f"{word:08x}\n" for word in self.words)

    @property
    def code_size(self) -> int:
        """Bytes of code, constants and first values of data."""
        return self.symbols["_image_end"]

    @property
    def data_size(self) -> int:
        """Bytes of data that is written, without the stack."""
        return self.symbols["_stack_bottom"] - self.symbols["_data_begin"]


def source(name: str) -> str:
    """Text of a file of this folder."""
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def find_cross_compiler() -> str:
    """Path of the compiler.

    Raises
    ------
    ToolMissing
        The compiler or its C library is not installed.
    """
    path = shutil.which(COMPILER)
    if path is None:
        raise ToolMissing(
            f"{COMPILER} was not found: run 'make firmware', or install it "
            f"(Debian, Ubuntu: apt-get install {PACKAGES})"
        )
    specs = subprocess.run(
        [path, "-print-file-name=picolibc.specs"], capture_output=True, text=True, check=True
    ).stdout.strip()
    if not Path(specs).is_absolute():
        raise ToolMissing(
            f"picolibc for {COMPILER} was not found: run 'make firmware', or "
            f"install it (Debian, Ubuntu: apt-get install {PACKAGES})"
        )
    return path


def build_image(
    files: Mapping[str, str],
    *,
    sources: Sequence[str],
    ram: int,
    stack: int = 1024,
    optimise: str = "-Os",
) -> Image:
    """Compile and link an image.

    Parameters
    ----------
    files : mapping
        Texts by file name, besides those of every image (start-up, devices).
    sources : sequence of str
        The C files among them.
    ram : int
        Bytes of memory.
    stack : int
        Bytes of stack that must remain.
    optimise : str
        Level of optimisation.

    Raises
    ------
    ToolMissing
        The compiler is not installed.
    ImageError
        The compiler or the linker failed, for example because the memory is too small.
    """
    compiler = find_cross_compiler()
    texts = _texts(files)
    with tempfile.TemporaryDirectory(prefix="firmware-") as name:
        folder = Path(name)
        for file, text in texts.items():
            (folder / file).write_text(text, encoding="utf-8")
        _run([compiler, *_arguments(sources, ram, stack, optimise), "-o", "image.elf"], folder)
        tool = compiler.removesuffix("gcc")
        _run([f"{tool}objcopy", "-O", "binary", "image.elf", "image.bin"], folder)
        data = (folder / "image.bin").read_bytes()
        listed = _run([f"{tool}nm", "image.elf"], folder)
    data += bytes(-len(data) % 4)
    words = tuple(int.from_bytes(data[k : k + 4], "little") for k in range(0, len(data), 4))
    symbols = {m[2]: int(m[1], 16) for m in re.finditer(r"(?m)^([0-9a-f]+) \w (\S+)$", listed)}
    return Image(words, symbols, ram)


def project_files(
    files: Mapping[str, str],
    *,
    sources: Sequence[str],
    ram: int,
    stack: int = 1024,
    optimise: str = "-Os",
) -> dict[str, str]:
    """All sources of an image by file name, with ``build.sh``, which makes ``firmware.hex``.

    Parameters are those of `build_image`.
    """
    command = " ".join(_arguments(sources, ram, stack, optimise))
    return {
        **_texts(files),
        "build.sh": _BUILD.format(
            compiler=COMPILER,
            packages=PACKAGES,
            arguments=command,
            objcopy=f"{COMPILER.removesuffix('gcc')}objcopy",
        ),
    }


_BUILD = """\
#!/bin/sh
# Builds firmware.hex, the first contents of the soft core's memory. Needs {packages}.
set -e
cd "$(dirname "$0")"
command -v {compiler} >/dev/null || {{
  echo "error: {compiler} not found: apt-get install {packages}" >&2; exit 2; }}
{compiler} {arguments} -o firmware.elf
{objcopy} -O binary firmware.elf firmware.bin
od -An -v -t x4 -w4 firmware.bin | tr -d ' ' > firmware.hex
"""


def _texts(files: Mapping[str, str]) -> dict[str, str]:
    """Add the files of every image."""
    return {**{name: source(name) for name in _FIXED}, **files}


def _arguments(sources: Sequence[str], ram: int, stack: int, optimise: str) -> list[str]:
    """Arguments of the compiler."""
    return [
        *CFLAGS,
        optimise,
        *_LINK,
        "-T",
        "link.ld",
        f"-Wl,--defsym=RAM_SIZE={ram},--defsym=STACK_SIZE={stack}",
        "start.S",
        "soc.c",
        *sources,
        "-lm",
    ]


def _run(command: Sequence[str], folder: Path) -> str:
    completed = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if completed.returncode:
        raise ImageError(failure(f"{Path(command[0]).name} failed", completed.stderr))
    return completed.stdout
