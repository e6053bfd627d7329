"""`boresight compile`: everything of a core, and of one that several programs share."""

from __future__ import annotations

import json
import subprocess

import pytest

from boresight.cli import main
from boresight.core_files import core_files, project_files
from boresight.sim.records.bundled import bundled
from boresight.verbs.compile import compile

NAMES = ["complementary", "complementary_as_printed"]


def test_compile_writes_everything(capsys, tmp_path):
    out = tmp_path / "build"
    assert main(["compile", "complementary", "--board", "mimas", "--json", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["digest"] == json.loads((out / "report.json").read_text())["digest"]
    assert {"complementary for small: Verilog", "mimas: sensors"} <= {*said.err.splitlines()}
    names = {p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file()}
    expected = [*core_files(["complementary"]), *project_files("mimas", system=True)]
    assert names == {*expected, ".boresight.json"}
    assert {
        "core.v",
        "core_sim.v",
        "microcode.lst",
        "program.json",
        "schedule.json",
        "report.json",
        "firmware/complementary.c",
        "ise-mimas/build.sh",
    } <= names
    assert "DSP48A1" in (out / "core.v").read_text()
    for file in ("core.v", "core_sim.v"):
        assert (out / file).read_text().startswith("// core: ")
    assert "DSP48A1 " not in (out / "core_sim.v").read_text()
    data = json.loads((out / "report.json").read_text())
    assert data["timing"]["latency_cycles"]["predicted"] <= 300


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shared")
    data = compile(
        *NAMES,
        output=folder,
        board="mimas",
        top="records",
        params={NAMES[1]: {"kp_roll_per_s": 4.0}},
    )
    return folder, data.report, data


def test_files(built):
    folder, data, _ = built
    assert json.loads((folder / "report.json").read_text()) == data
    for name in NAMES:
        for file in (
            f"microcode-{name}.lst",
            f"program-{name}.json",
            f"schedule-{name}.json",
            f"firmware/{name}.c",
        ):
            assert (folder / file).stat().st_size > 1000
    assert not (folder / "program.json").exists()
    readme = (folder / "ise-mimas" / "README.txt").read_text()
    for number, name in enumerate(NAMES):
        interval = data["programs"][name]["timing"]["interval_cycles"]
        assert f"  {number}       {name.ljust(24)}  {interval}\n" in readme
    assert "to register 516\n" in readme


def test_what_it_returns(built):
    folder, data, result = built
    assert (result.output, result.config, result.word) == (folder, "small", 32)
    assert result.digest == data["digest"] and result.to_json() is data
    assert result.core is None and result.system is None
    for program, name in zip(result.programs, NAMES, strict=True):
        timing = data["programs"][name]["timing"]
        assert program.name == name
        assert program.latency_cycles == timing["latency_cycles_by_output"]
        assert program.interval_cycles == timing["interval_cycles"]
        heading = program.latency_cycles["heading"]
        assert f"{folder}: {name}: " in str(result) and f", heading {heading}, " in str(result)
    page = result._repr_html_()
    heading = result.programs[0].latency_cycles["heading"]
    assert f"<td>{NAMES[0]}</td><td>heading</td><td>{heading}</td>" in page


def test_report(built):
    _, data, _ = built
    assert data["core"] == "core" and list(data["programs"]) == NAMES
    words = [r["timing"]["interval_cycles"] for r in data["programs"].values()]
    assert data["microcode"] == {
        "words": sum(words),
        "depth": 768,
        "bits": 54,
        "first_word": dict(zip(NAMES, (0, words[0]), strict=True)),
    }
    assert data["states"] == {"used": 30, "available": 128}
    assert data["digest"] not in {r["digest"] for r in data["programs"].values()}


def test_registers(built):
    folder, data, _ = built
    registers = json.loads((folder / "registers.json").read_text())
    by_name = {r["name"]: r for r in registers["registers"]}
    assert by_name["program"]["address"] == 516 and by_name["program"]["names"] == NAMES
    assert by_name["complementary.kp_roll_per_s"]["meaning"] == "roll: as kp_pitch_per_s"
    frac = by_name["complementary.kp_roll_per_s"]["frac"]
    resets = [by_name[f"{n}.kp_roll_per_s"]["reset"] for n in NAMES]
    assert resets[1] == 4 << frac != resets[0]
    assert [p["program"] for p in registers["programs"]] == NAMES
    assert registers["digest"] == data["digest"]
    addresses = [r["address"] for r in registers["registers"]]
    assert len(set(addresses)) == len(addresses)
    main_c = (
        '#include "registers.h"\nint main(void) { return CORE_PROGRAM_ADDR == 516'
        " && CORE_PROGRAM_COMPLEMENTARY == 0 && CORE_PROGRAM_COMPLEMENTARY_AS_PRINTED == 1"
        " && CORE_COMPLEMENTARY_KP_ROLL_PER_S_ADDR == 1 ? 0 : 1; }\n"
    )
    (folder / "main.c").write_text(main_c)
    subprocess.run(
        ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "main.c", "-o", "main"],
        cwd=folder,
        check=True,
    )
    assert subprocess.run([folder / "main"]).returncode == 0
    page = (folder / "registers.md").read_text()
    assert "| `program` | 1 | `complementary_as_printed` |" in page
    assert "## Output record of `complementary_as_printed`" in page


def test_command_line(tmp_path, capsys):
    assert main(["compile", *NAMES, "--config", "fast", "-o", str(tmp_path), "-q"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1] for line in out[:2]] == NAMES
    assert out[2].startswith("proven: 322 operations, microcode and C, all inputs")
    assert (
        main(
            [
                "check",
                ",".join(NAMES),
                str(bundled("ximu_walk")),
                "--steps",
                "20",
                "--levels",
                "fixed,c",
                "-q",
                "--param",
                f"{NAMES[1]}.kp_roll_per_s=3",
            ]
        )
        == 0
    )
    out = capsys.readouterr().out
    assert out.count("mismatches") == 4 and out.endswith("good\n")


def test_target_and_axi(tmp_path, capsys):
    words = ["compile", "complementary", "-q", "-o", str(tmp_path / "out")]
    assert main([*words, "--target", "generic", "--axi"]) == 0
    names = {p.relative_to(tmp_path / "out").as_posix() for p in (tmp_path / "out").rglob("*.*")}
    assert names == {
        *core_files(["complementary"], target="generic", axi=True),
        ".boresight.json",
    } - {"tb/Makefile"}
    core = (tmp_path / "out" / "core.v").read_text()
    assert "it has no vendor primitives" in core and "DSP48A1" not in core
    assert "`core_axi` has input records" in (tmp_path / "out" / "README.md").read_text()
