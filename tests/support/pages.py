"""Code blocks of Markdown pages, and how they are run: each page in a folder of its own.

A block after a line that ends in "as `NAME`:" is a file, and written. Otherwise ``python`` is run,
one page being one module. ``sh`` is command lines, of which `boresight` is called by its entry
point and ``pytest`` by calling the tests; a few tools run as they are, and what sets up an
environment does not. ``text`` is what the block before it printed, of command lines the last:
``...`` stands for any lines, decimals may differ, times, identities of cores and Icarus, which not
all have, do not count. ``toml`` and ``yaml`` are parsed, of workflows the command lines too. A
block without a language is a drawing; one in braces is Sphinx's own, and the build of the site
checks it.

``<!-- parsed, not run: WHY -->`` before a block of command lines: their arguments are looked at.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml  # type: ignore[import-untyped]

from boresight import cli

ROOT = Path(__file__).parents[2]
#: Pages for users, by path below the root.
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in (
        "README.md",
        *(f"docs/{f}*.md" for f in ("", "learn/", "reference/", "systems/")),
    )
    for path in ROOT.glob(pattern)
    if path.name != "commands.md"  # `make docs` writes it
)
#: First words of command lines that set up an environment, or wait for a person.
SETUP = ("python3", ".", "pip", "make", "source", "gtkwave")
#: First words of command lines that are run as they are.
TOOLS = ("sed", "mkdir", "cp", "python")
#: How far a decimal may be from the page's.
NEAR = 0.2
_VARIES = re.compile(r"\s+[\d.,]+ s$|(?<=, core )[0-9a-f]{12}$")


@dataclass(frozen=True)
class Block:
    """A code block.

    Attributes
    ----------
    language, text : str
    line : int
        Of its first line in the page.
    name : str
        The file that it is, or empty.
    parsed : bool
        Only looked at.
    """

    language: str
    text: str
    line: int
    name: str
    parsed: bool


def blocks_of(page: str) -> list[Block]:
    """The code blocks of a page's text."""
    results, before, lines = [], "", page.splitlines()
    k = 0
    while k < len(lines):
        fence = re.match(r"( *)(`{3,})(.*)$", lines[k])
        if fence is None:
            before = lines[k].strip() or before
            k += 1
            continue
        end = next(j for j in range(k + 1, len(lines)) if lines[j].strip() == fence[2])
        name = re.search(r"as `([\w./]+)`:$", before)
        text = "".join(f"{line.removeprefix(fence[1])}\n" for line in lines[k + 1 : end])
        only = before.startswith("<!-- parsed, not run: ")
        results.append(Block(fence[3].strip(), text, k + 2, name[1] if name else "", only))
        before, k = "", end + 1
    return results


@contextlib.contextmanager
def user_folder(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A user's folder as the current one, in which his modules are found; nothing of them stays.

    Verilator runs alone: what a second simulator says is tested elsewhere.
    """
    patch.chdir(folder)
    patch.setattr(sys, "path", [str(folder), *(p for p in sys.path if p != f"{ROOT}/examples")])
    patch.setattr(sys, "dont_write_bytecode", True)
    patch.setattr("boresight.sim.compare.check.default_simulator", lambda: "verilator")
    yield folder
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(f"{folder}/"):
            del sys.modules[name]


def parsed(line: str) -> None:
    """Whether the arguments of a command line are what its verb takes; raises InputError."""
    cli.parse(shlex.split(line.partition(" > ")[0], comments=True)[1:])


def run_page(page: str, folder: Path) -> int:
    """Run all blocks of a page in a folder, which is the current one; how many there are.

    Raises
    ------
    AssertionError
        A block that fails, is of no known kind, or prints something else than the page shows.
    """
    space: dict[str, Any] = {"__name__": Path(page).stem}
    said, previous, blocks = "", "", blocks_of((ROOT / page).read_text(encoding="utf-8"))
    for k, block in enumerate(blocks):
        after = blocks[k + 1] if k + 1 < len(blocks) else None
        where = f"{page}, line {block.line}"
        shown = after.text if after is not None and after.language == "text" else ""
        if block.name:
            path = folder / block.name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            with _heard() as heard:
                exec(compile(block.text, where, "exec"), space)
            said = heard.getvalue()
        elif block.language == "sh":
            for line in block.text.splitlines():
                said = _command(line, folder, where, shown, only=block.parsed)
        elif block.language == "yaml":
            yaml.safe_load(block.text)
            for line in re.findall(r"- (?:run: )?(boresight .+)", block.text):
                parsed(line)
        elif block.language == "toml":
            tomllib.loads(block.text)
        elif block.language == "text":
            assert previous in ("sh", "python"), f"{where}: the output of nothing"
            assert same_text(block.text, said), f"{where}: shown\n{block.text}\nsaid\n{said}"
        else:
            site = block.language.startswith("{")  # Sphinx's own
            assert block.language == "" or site, f"{where}: no test runs {block.language}"
        previous = "" if block.name else block.language
    return len(blocks)


@contextlib.contextmanager
def _heard() -> Iterator[io.StringIO]:
    """What is printed inside, on either stream."""
    heard = io.StringIO()
    with contextlib.redirect_stdout(heard), contextlib.redirect_stderr(heard):
        yield heard


def _command(line: str, folder: Path, where: str, shown: str, *, only: bool) -> str:
    """Run one command line; what it said, unless that goes to a file."""
    line, _, target = line.partition(" > ")
    words = shlex.split(line, comments=True)
    if not words or words[0] in SETUP:
        return ""
    program = words[0].rpartition("/")[2]
    if only:
        assert program in ("boresight", "make", "pytest"), f"{where}: what is {line!r}?"
        if program == "boresight":
            parsed(line)
        return ""
    with _heard() as heard:
        if program == "boresight":
            code = cli.main([*words[1:], *(["-q"] if "-q" not in words else [])])
            assert code == _code(shown), f"{where}: {line}: {code}\n{heard.getvalue()}"
            if target:
                (folder / target.strip()).write_text(heard.getvalue(), encoding="utf-8")
        elif program == "pytest":
            call_tests(folder)
        else:
            assert program in TOOLS, f"{where}: {line!r} is not run by any test"
            command = [sys.executable if program == "python" else program, *words[1:]]
            subprocess.run(command, check=True, cwd=folder)
    return heard.getvalue()


def _code(shown: str) -> int:
    """The exit code that goes with what a page shows."""
    lines = shown.splitlines() or [""]
    if lines[-1].startswith("error: "):
        return 2
    return int(lines[-1].startswith("FAILED"))


def call_tests(folder: Path) -> None:
    """What pytest does with the files of a folder: call their tests."""
    called = 0
    sys.path.insert(0, str(folder))
    for path in sorted(folder.glob("test_*.py")):
        for name in [p.stem for p in folder.glob("*.py")]:
            sys.modules.pop(name, None)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        for name, test in vars(module).items():
            if name.startswith("test_"):
                test()
                called += 1
    sys.path.remove(str(folder))
    assert called, f"no tests in {folder}"


def same_text(shown: str, said: str) -> bool:
    """Whether output is what a page shows: ``...`` is any lines, decimals may differ by `NEAR`."""
    wanted, got = (
        [_VARIES.sub("", line) for line in text.splitlines()]
        for text in (shown.rstrip("\n"), said.rstrip("\n"))
    )
    if "..." not in wanted:
        return len(wanted) == len(got) and all(map(_same_line, wanted, got))
    cut = wanted.index("...")
    rest = wanted[cut + 1 :]
    if len(got) < cut + len(rest) or not all(map(_same_line, wanted[:cut], got)):
        return False
    if not rest:
        return True
    return any(same_text("\n".join(rest), "\n".join(got[k:])) for k in range(cut, len(got)))


def _same_line(shown: str, said: str) -> bool:
    a, b = shown.split(), said.split()
    return len(a) == len(b) and all(map(_same_word, a, b))


def _same_word(shown: str, said: str) -> bool:
    if shown == said:
        return True
    if not re.search(r"\d[.e]", shown):
        return False
    number = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
    if number.sub("", shown) != number.sub("", said):
        return False
    return all(
        abs(float(a) - float(b)) <= NEAR * abs(float(a))
        for a, b in zip(number.findall(shown), number.findall(said), strict=True)
    )
