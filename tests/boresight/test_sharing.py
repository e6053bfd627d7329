"""Names and parameters of several estimators; several in one compile and check."""

from __future__ import annotations

import json
import subprocess

import pytest

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.sharing import estimator_names, params_for_each, params_of_each
from boresight.sim.records.bundled import bundled
from boresight.verbs.compile import compile

NAMES = ["complementary", "complementary_as_printed"]


def test_names():
    assert estimator_names("complementary") == NAMES[:1]
    assert estimator_names(*NAMES) == estimator_names(",".join(NAMES)) == NAMES
    with pytest.raises(
        InputError,
        match=r"^estimators: wanted each name once, found complementary "
        r"twice; .*$",
    ):
        estimator_names("complementary", ",".join(NAMES))
    with pytest.raises(InputError, match=r"^estimator: wanted one of .*, found 'kalman'; .*$"):
        estimator_names("complementary", "kalman")


def test_parameters_by_estimator(tmp_path):
    file = tmp_path / "p.json"
    file.write_text(
        json.dumps(
            {"estimator": NAMES[1], "parameters": {"kp_roll_per_s": 2.0, "kp_pitch_per_s": 3.0}}
        )
    )
    found = params_for_each(
        NAMES, [file], [f"{NAMES[1]}.kp_roll_per_s=1.5", "complementary.declination_ht=0.25"]
    )
    assert found == {
        NAMES[1]: {"kp_roll_per_s": 1.5, "kp_pitch_per_s": 3.0},
        "complementary": {"declination_ht": 0.25},
    }
    assert params_of_each(NAMES, found) == [{"declination_ht": 0.25}, found[NAMES[1]]]
    assert params_of_each(NAMES, {NAMES[1]: {}}) == [None, {}]
    assert params_of_each(NAMES[:1], {"x": 1.0}) == [{"x": 1.0}]
    assert params_of_each(NAMES, None) == [None, None]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            "kp_roll_per_s=1",
            r"^--param kp_roll_per_s: wanted parameters of complementary, "
            r"complementary_as_printed, found no estimator's name; write for example "
            r"--param complementary\.NAME=NUMBER$",
        ),
        ("mekf.x=1", r"^--param mekf\.x: wanted .*, found those of mekf; .*$"),
        ("complementary.x=1", r"^parameter x: wanted one of .*$"),
        ("complementary.kp_roll_per_s=-1", r"^parameter kp_roll_per_s: wanted 0 to 32 1/s, .*$"),
        ("complementary.kp_roll_per_s=a", r"^--param: wanted NAME=NUMBER, found '.*=a'; .*$"),
    ],
)
def test_parameters_of_nobody_are_refused(setting, message):
    with pytest.raises(InputError, match=message):
        params_for_each(NAMES, [], [setting])


def test_parameters_not_by_estimator_are_refused():
    with pytest.raises(
        InputError,
        match=r"^parameters: wanted values of complementary, .*, found "
        r"kp_roll_per_s; .*$",
    ):
        params_of_each(NAMES, {"kp_roll_per_s": 1.0})


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
    return folder, data


def test_files(built):
    folder, data = built
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


def test_report(built):
    _, data = built
    assert data["core"] == "core" and list(data["programs"]) == NAMES
    words = [r["timing"]["interval_cycles"] for r in data["programs"].values()]
    assert data["microcode"] == {
        "words": sum(words),
        "depth": 768,
        "bits": 54,
        "first_word": dict(zip(NAMES, (0, words[0]), strict=True)),
    }
    assert data["states"] == {"used": 32, "available": 128}
    assert data["digest"] not in {r["digest"] for r in data["programs"].values()}


def test_registers(built):
    folder, data = built
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
    assert [line.split(": ")[1] for line in out] == NAMES
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
    assert main(["compile", "complementary", "complementary"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
