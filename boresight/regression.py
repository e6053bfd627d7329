"""Results beside those of an earlier day, on the command line and in Python; JUnit files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any
from xml.etree import ElementTree

from boresight.model.errors import InputError
from boresight.model.tools.files import OutputFile
from boresight.options import Argument, Option, Outcome, Verb, arguments_of
from boresight.sim.answer import Answer, Figure
from boresight.sim.baseline import NAMES, Baseline, compared, read_baseline

__all__ = ["JudgedVerb", "baseline", "junit"]


def baseline(
    result: Answer, file: str | Path, *, allow: Mapping[str, float] | None = None
) -> Baseline:
    """Compare a result with that of an earlier day.

    Parameters
    ----------
    result : Answer
        Of `boresight.check`, `compile` or `accuracy`.
    file : path
        Output of the verb with ``--json``; or ``json.dumps(result.to_json())``.
    allow : mapping of str to float
        Accepted shares of worsening other than `boresight.sim.answer.SHARES`, by kind of figure.

    Returns
    -------
    Baseline
        ``good`` unless something got worse by more than accepted; as text a table.

    Raises
    ------
    InputError
        A file that is no such result, a result of something else, an unknown kind.
    """
    if not result.judged:
        raise InputError.at(
            "baseline",
            wanted="a result of check, compile or accuracy",
            found=f"a {type(result).__name__}",
            fix="compare one of these",
        )
    earlier = read_baseline(file, result.judged)
    return compared(result, earlier, result.judged, file=file, allow=allow)


def _baseline_options(
    *,
    baseline: Annotated[str | Path | None, Option(metavar="FILE")] = None,
    allow: Annotated[Mapping[str, float] | None, Option(metavar="KIND=SHARE")] = None,
    junit: Annotated[str | Path | None, Option(metavar="FILE")] = None,
) -> None:
    """Further options of a judged verb.

    Parameters
    ----------
    baseline : path
        Output of an earlier --json: fails where a figure is worse by more than accepted.
    allow : mapping
        Accepted worsening, repeatable: of cycles 0, area 0.01, clock 0.05, error 0.1, count 0.
    junit : path
        Also write the verdicts as JUnit XML.
    """


class JudgedVerb(Verb):
    """A verb whose results can be compared with those of an earlier day.

    Parameters
    ----------
    modes, call
        See `Verb`.
    judged : mapping of str to Figure
        `Answer.judged` of its result.
    """

    def __init__(
        self,
        *modes: Callable[..., Any],
        call: Callable[..., Outcome] | None = None,
        judged: Mapping[str, Figure],
    ) -> None:
        super().__init__(*modes, call=call)
        self.judged = judged

    @cached_property
    def arguments(self) -> dict[str, Argument]:
        """All its arguments, by name."""
        return super().arguments | arguments_of(_baseline_options)

    def run(self, parsed: Mapping[str, Any]) -> Outcome:
        """Run the verb, compare, write the JUnit file."""
        options = arguments_of(_baseline_options)
        typed = {n: options[n].convert(value) for n, value in parsed.items() if n in options}
        file: Any = typed.get("baseline")
        name = self.modes[0].__name__
        earlier = None if file is None else read_baseline(file, self.judged)
        if earlier is not None:  # unknown kinds are refused before the work
            compared(earlier, earlier, self.judged, file=file, allow=typed.get("allow"))
        elif "allow" in typed:
            raise InputError.at(
                "--allow", wanted="--baseline with it", found="none", fix="name an earlier result"
            )
        target = None
        if "junit" in typed:
            words = [parsed[n] for n in self.arguments if n in parsed and n != "junit"]
            flat = [w for word in words for w in (word if isinstance(word, list) else [word])]
            inputs = [w for w in flat if isinstance(w, str) and Path(w).is_file()]
            target = OutputFile(typed["junit"], inputs=inputs, option="--junit")
        code, data, text = super().run({n: v for n, v in parsed.items() if n not in options})
        comparison = None
        if earlier is not None:
            comparison = compared(data, earlier, self.judged, file=file, allow=typed.get("allow"))
            data = {**data, "baseline": comparison.to_json(), "good": not code and comparison.good}
            text = f"{text.removesuffix('good') if not comparison.good else text}".rstrip("\n")
            text = f"{text}\n{comparison}".lstrip("\n")
            code = code or int(not comparison.good)
        if target is not None:
            target.write(junit(name, data, comparison))
        return code, data, text


def junit(suite: str, data: Any, baseline: Baseline | None = None) -> str:
    """Verdicts as JUnit XML: a test case for each object with ``good``, and each figure compared.

    Parameters
    ----------
    suite : str
        The verb.
    data
        Plain data of a result.
    baseline : Baseline, optional
        Figures that changed, of which those fail that are worse.
    """
    cases = ElementTree.Element("testsuite", name=f"boresight {suite}")
    verdicts = list(_verdicts(data, suite))
    if baseline is not None:
        for c in baseline.changes:
            change = f"{c.before} -> {c.now} {c.unit}".rstrip()
            verdicts.append((baseline.file, c.figure, change if c.worse else "", None))
        verdicts.append((baseline.file, f"{baseline.equal} equal figures", "", None))
    for where, name, failure, seconds in verdicts or [(suite, suite, "", None)]:
        case = ElementTree.SubElement(cases, "testcase", classname=where, name=name)
        if seconds is not None:
            case.set("time", f"{seconds:.3f}")
        if failure:
            ElementTree.SubElement(case, "failure", message=failure)
    cases.set("tests", str(len(cases)))
    cases.set("failures", str(sum(len(case) > 0 for case in cases)))
    ElementTree.indent(cases)
    text: str = ElementTree.tostring(cases, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'


def _verdicts(data: Any, where: str) -> Iterator[tuple[str, str, str, float | None]]:
    """Class, name, failure and seconds of each object with ``good``, the innermost first."""
    if isinstance(data, list):
        for entry in data:
            yield from _verdicts(entry, where)
    if not isinstance(data, dict):
        return
    name = " ".join(str(data[n]) for n in NAMES if data.get(n))
    for key, entry in data.items():
        if key != "baseline":
            yield from _verdicts(entry, f"{where}.{name}" if name else where)
    if isinstance(data.get("good"), bool):
        values = ", ".join(
            f"{k} {v}"
            for k, v in data.items()
            if k != "good" and v and isinstance(v, int | float | str)
        )
        failure = "" if data["good"] else str(data.get("failure") or values or "not good")
        yield where, name or "verdict", failure, data.get("seconds")
