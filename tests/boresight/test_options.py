"""Options from functions: what argparse gets, what the function gets, what is refused."""

from __future__ import annotations

import json
from argparse import ArgumentParser
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import pytest

from boresight.model.errors import InputError
from boresight.options import (
    Arguments,
    EstimatorName,
    EstimatorNames,
    Jobs,
    Logs,
    Option,
    OutputFolder,
    Params,
    PythonOnly,
    Verb,
    Word,
    arguments_of,
    outcome,
)
from boresight.terminal import tell

pytestmark = pytest.mark.pythons

BOTH = ["complementary", "complementary_as_printed"]


class Result:
    good = False

    def __init__(self, **values: Any) -> None:
        self.values = values

    def to_json(self) -> dict[str, Any]:
        return self.values

    def __str__(self) -> str:
        return "text"


def first(
    name: EstimatorName,
    *logs: Logs,
    word: Word = 32,
    with_cpu: bool = False,
    synth: bool = True,
    factor: float | None = None,
    levels: Sequence[str] = ("c", "rtl"),
    reads: Annotated[Sequence[str], Option(("--read",), repeated=True)] = (),
    feed: Mapping[str, float] | None = None,
    params: Params = None,
    jobs: Jobs = None,
    output: OutputFolder = "build",
    inner: Annotated[int, PythonOnly] = 7,
    progress: Callable[[str], None] | None = None,
) -> Result:
    """A function.

    Parameters
    ----------
    factor : float
        Times.
    with_cpu, synth : bool
        With ``it``,
        100 % of it.

    Returns
    -------
    Result
        No parameter.
    """
    return Result(**locals())


def second(name: EstimatorName, *, steps: int | None = None) -> Result:
    """Another."""
    return Result(**locals())


def typed(verb: Verb, *words: str, quiet: bool = True, json: bool = False) -> Any:
    parser = ArgumentParser()
    for argument in verb.arguments.values():
        argument.add_to(parser)
    return verb.run({**vars(parser.parse_args(words)), "quiet": quiet, "json": json})[1]


def test_what_is_not_typed_is_the_default_of_the_function() -> None:
    values = typed(Verb(first), "mekf", "a", "b")
    assert values == first("mekf", "a", "b").values


def test_every_kind_of_option() -> None:
    line = "mekf a --word 20 --with-cpu --no-synth --factor 2.5 --levels a,b --read x --read y "
    line += "--feed p=1 --feed q=2 --jobs 3 -o out"
    values = typed(Verb(first), *line.split(), quiet=False)
    more = {"feed": {"p": 1.0, "q": 2.0}, "jobs": 3, "output": "out", "progress": tell}
    assert values == first(
        "mekf", "a", word=20, with_cpu=True, synth=False, factor=2.5, levels=["a", "b"],
        reads=["x", "y"], **more,
    ).values  # fmt: skip


def test_help_is_of_the_docstring_and_names_the_default() -> None:
    arguments = arguments_of(first)
    assert arguments["synth"].text == arguments["with_cpu"].text == "With it, 100 % of it."
    assert arguments["word"].text == "Word width, 18 to 32 bits; default 32."
    assert arguments["levels"].text.endswith("; default c,rtl.")
    assert arguments["jobs"].text == "At once; default: one for each processor."
    assert [a.shown for a in arguments.values()] == [
        "ESTIMATOR", "LOG", "--word WORD", "--with-cpu", "--no-synth", "--factor FACTOR",
        "--levels LEVELS", "--read READS", "--feed FEED", "--params FILE.json",
        "--param NAME=NUMBER", "--jobs JOBS", "-o, --output DIR",
    ]  # fmt: skip
    parser = ArgumentParser()
    arguments["synth"].add_to(parser)
    assert "100 % of it" in parser.format_help()


def test_a_log_is_required() -> None:
    with pytest.raises(SystemExit):
        typed(Verb(first), "mekf")


def test_an_option_that_a_mode_does_not_take_is_refused() -> None:
    def call(arguments: Arguments, name: str, *, other: bool = False) -> Any:
        """Either.

        Parameters
        ----------
        other : bool
            The other.
        """
        if other:
            arguments.only(second, wanted="the first", found="the second", instead="sing, or ")
            return outcome(arguments.call(second, name))
        return outcome(arguments.call(first, name))

    verb = Verb(first, second, call=call)
    assert list(verb.arguments)[0] == "name" and "logs" not in verb.arguments
    assert typed(verb, "mekf", "--other", "--steps", "3") == {"name": "mekf", "steps": 3}
    message = "^--word: wanted the first, found the second; sing, or leave --word out$"
    with pytest.raises(InputError, match=message):
        typed(verb, "mekf", "--other", "--word", "32")
    with pytest.raises(InputError, match="^--steps: wanted another use of this verb, found one"):
        typed(verb, "mekf", "--steps", "3")


def of_several(name: EstimatorNames, *others: EstimatorNames, params: Params = None) -> Result:
    """Of several."""
    return Result(**locals())


def test_values_of_one_stand_alone_of_several_by_name(tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"kp_roll_per_s": 2.0, "kp_pitch_per_s": 3.0}))
    line = ["--params", str(file), "--param", "kp_roll_per_s=1.5", "--param", "mag_gate=1"]
    values = {"kp_roll_per_s": 1.5, "kp_pitch_per_s": 3.0, "mag_gate": 1.0}
    assert typed(Verb(first), BOTH[0], "log", *line)["params"] == values
    assert typed(Verb(of_several), BOTH[0], *line)["params"] == values
    line = ["--param", f"{BOTH[1]}.kp_roll_per_s=1.5"]
    for names in (BOTH, [",".join(BOTH)]):
        assert typed(Verb(of_several), *names, *line)["params"][BOTH[1]] == {"kp_roll_per_s": 1.5}
    with pytest.raises(InputError, match="^estimator: .* found 'complementary,compl"):
        typed(Verb(first), ",".join(BOTH), "log", *line)


@pytest.mark.parametrize(("name", "option"), [("output", "-o"), ("reproducer", "--reproducer")])
def test_a_parameter_file_is_no_output(name: str, option: str, tmp_path: Path) -> None:
    def function(
        name: EstimatorName,
        *,
        params: Params = None,
        output: OutputFolder = "",
        reproducer: str | None = None,
    ) -> Result:
        """One."""
        return Result(**locals())

    file = tmp_path / "p.json"
    file.write_text("{}")
    line = [BOTH[0], "--params", str(file)]
    with pytest.raises(
        InputError, match=f"found the same file as .*; choose another with {option}$"
    ):
        typed(Verb(function), *line, f"--{name}", str(tmp_path / "." / "p.json"))
    assert typed(Verb(function), *line)["params"] == {}


@pytest.mark.parametrize("json_", [False, True])
def test_progress(json_: bool) -> None:
    for quiet, shown in ((False, tell), (True, None)):
        assert Arguments({}, {}, quiet=quiet, json=json_).progress is shown


def test_the_exit_code_is_of_what_is_good() -> None:
    assert outcome(Result(a=1), " more") == (1, {"a": 1}, "text more")
    assert outcome(type("R", (Result,), {"good": True})())[0] == 0
