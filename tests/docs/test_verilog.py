"""The page on the Verilog in one's design does what it says: every block of it is run."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from boresight.cli import main
from boresight.gateware.texts.core import integration_names
from boresight.sim.rtl.simulators import available

PAGE = Path(__file__).parents[2] / "docs" / "verilog.md"
FILES = {"python": ["track.py"], "verilog": ["sample.v", "demo.v"], "c": ["driver.c", "main.c"]}


@pytest.mark.skipif(not available("icarus"), reason="Icarus Verilog: apt-get install iverilog")
def test_every_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = PAGE.read_text(encoding="utf-8")
    blocks = re.findall(r"```(\w+)\n(.*?)```", page, re.S)
    monkeypatch.chdir(tmp_path)
    names = {kind: iter(files) for kind, files in FILES.items()}
    for kind, text in blocks:
        if kind in FILES:
            Path(next(names[kind])).write_text(text)
    assert not [name for rest in names.values() for name in rest]
    said, compared = "", 0
    for kind, text in blocks:
        if kind == "text":
            assert text == said
            compared += 1
        for line in text.splitlines() if kind == "sh" else ():
            program, *words = shlex.split(line)
            if program == "boresight":
                assert main([*words, "--quiet"]) == 0
                continue
            done = subprocess.run([program, *words], capture_output=True, text=True, check=True)
            said = done.stdout
            if program == "make":
                assert "PASS core: 120 words of 60 records" in said
    assert compared == 2
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Icore", "-fsyntax-only"]
    subprocess.run(["gcc", *flags, "driver.c"], check=True)
    core = (tmp_path / "core" / "README.md").read_text()
    formats = re.findall(r"`(\w+)` is `(fixed<\S+>)`", page)
    assert len(formats) == 2
    assert all(f"| `{name}` | `{form}` |" in core for name, form in formats)
    for name in integration_names(generic=False):
        assert f"`{name.partition('/')[0]}" in page, name
    capsys.readouterr()
