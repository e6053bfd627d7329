"""Command lines as people type them, good and bad: strategies of hypothesis."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from hypothesis import strategies as st

from tests.support import bad_files
from tests.support.estimators import ALL

#: Files of the folder in which a command runs.
FILES: Mapping[str, st.SearchStrategy[bytes]] = {
    "log.csv": bad_files.csv_logs(),
    "log.npz": bad_files.npz_logs(),
    "params.json": bad_files.parameters(),
    "map.json": bad_files.maps(),
    "reproducer.json": bad_files.reproducers(),
    "capture.bin": bad_files.captures(),
}

_NUMBERS = st.one_of(
    st.sampled_from(
        ["0", "-1", "1", "2", "3", "0.5", "18", "25", "32", "33", "1e5", "nan", "inf", "-inf",
         "0x10", "1_0", "٣", "9" * 30, "9" * 400, "9" * 5000, "", " ", "+1", "1.5", "-0", "1e-320",
         "2147483648", "4294967296", "1e999"]
    ),
    st.integers().map(str),
    st.floats().map(str),
)  # fmt: skip


def _harmless(text: str) -> bool:
    """No path that leads out of the folder, and nothing that exec refuses."""
    return "\0" not in text and not text.startswith(("/", "~", "-o", "--o")) and ".." not in text


#: Any text that may stand in a command line, bytes that are not UTF-8 included.
_TEXTS = st.one_of(
    st.sampled_from(
        ["", " ", "-", "--", "-x", "--nosuch", "=", "a=b", "a=", "=1", ",", "a,,b", "x" * 3000,
         "%s", "{}", "é\u202e", "\n", "a\nb\n", "\x1b[31m", "\udcff", "MEKF", "mekf ", "None"]
    ),
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=12),
    st.binary(max_size=8).map(os.fsdecode),
).filter(_harmless)  # fmt: skip
_PATHS = st.sampled_from(
    [*FILES, "folder", "nosuch", "nosuch/log.csv", "log.csv/x", ".", "n" * 300, "n/" * 2500,
     "/dev/null", "/dev/zero", "loop", "gone", "pipe.csv/"]
)  # fmt: skip
_OUTPUTS = st.sampled_from(["out", "new/out", "log.csv/out", "n" * 300, "folder"])


def _mostly(*good: str) -> st.SearchStrategy[str]:
    """One of the good words, less often anything."""
    right = st.sampled_from(good)
    return st.integers(0, 9).flatmap(lambda k: st.one_of(_TEXTS, _NUMBERS) if k == 9 else right)


def _number(*good: str) -> st.SearchStrategy[str]:
    right = st.sampled_from(good)
    return st.integers(0, 3).flatmap(lambda k: _NUMBERS if k == 3 else right)


_NAMES = _mostly("complementary", "mekf", *ALL)
_SEVERAL = st.one_of(_NAMES, st.lists(st.sampled_from([*ALL, "vqf", ""]), max_size=3).map(",".join))
_LOGS = st.integers(0, 5).flatmap(
    lambda k: st.one_of(_PATHS, _TEXTS) if k == 5 else st.sampled_from(["log.csv", "log.npz"])
)
_SETTINGS = st.builds(
    "{}={}".format,
    _mostly("kp_roll_per_s", "complementary.kp_roll_per_s", "mekf.p0_bias", "p0_tilt"),
    _number("0.5", "1"),
)

_WORDS = {
    "--word": _number("32", "18", "26"),
    "--params": st.one_of(st.just("params.json"), _PATHS),
    "--param": st.one_of(_SETTINGS, _TEXTS),
}
_MODEL = {"--config": _mostly("small", "fast", "medium"), **_WORDS}
_STEPS = {"--steps": _number("1", "5", "100")}

#: Each verb's positional arguments, and its options; None: a flag.
VERBS: Mapping[str, tuple[list[Any], dict[str, Any]]] = {
    "new": ([_mostly("mine", "folder/mine.py", "class", "numpy")], {}),
    "list": ([], {}),
    "doctor": ([], {}),
    "compile": (
        [_NAMES, st.one_of(st.none(), _NAMES)],
        {
            **_MODEL,
            "--board": _mostly("mimas", "sk-xc6slx9"),
            "--top": _mostly("sensors", "records"),
            "--synth": None,
            "--urgent": _number("1", "3"),
            "-o": _OUTPUTS,
        },
    ),
    "run": (
        [_NAMES, _LOGS],
        {**_MODEL, **_STEPS, "--on": _mostly("float", "fixed", "c", "rtl"), "-o": _OUTPUTS},
    ),
    "check": (
        [st.one_of(_SEVERAL, st.just("replay")), st.one_of(_LOGS, st.just("reproducer.json"))],
        {
            **_MODEL,
            **_STEPS,
            "--levels": _mostly("fixed", "c", "rtl", "fixed,c", "c,,rtl"),
            "--simulator": _mostly("verilator", "icarus"),
            "--reproducer": _OUTPUTS,
        },
    ),
    "report": (
        [_NAMES, _LOGS, st.one_of(st.none(), _LOGS)],
        {
            **_MODEL,
            **_STEPS,
            "--no-synth": None,
            "--comparison": None,
            "--widths": None,
            "--against": st.one_of(st.just("reproducer.json"), _PATHS),
            "-o": _OUTPUTS,
        },
    ),
    "tune": (
        [_NAMES, _LOGS, st.one_of(st.none(), _LOGS)],
        {
            **_WORDS,
            "--folds": _number("1", "2"),
            "--seed": _number("1"),
            "--weight": _mostly("total=1", "heading=0.5", "bias=1", "total"),
            "--only": _mostly("kp_roll_per_s", "p0_tilt", "kp_roll_per_s,kp_roll_per_s"),
            "--rounds": _number("1"),
            "--detune": _number("1", "3.5"),
            "--jobs": _number("1"),
            "-o": _OUTPUTS,
        },
    ),
    "accuracy": (
        [st.one_of(_SEVERAL, st.just("published")), _LOGS, st.one_of(st.none(), _LOGS)],
        {
            **_WORDS,
            "--no-float": None,
            "--comparison": _mostly("log", "log,log"),
            "--jobs": _number("1"),
            "-o": _OUTPUTS,
        },
    ),
    "fit": ([_NAMES, _LOGS], {**_WORDS, **_STEPS, "-o": _OUTPUTS}),
    "convert": ([_mostly("broad"), st.one_of(st.just("folder"), _PATHS)], {"-o": _OUTPUTS}),
    "experiment": (
        [_mostly("ma2014")],
        {"--seed": _number("1"), "--runs": _number("2"), "-o": _OUTPUTS},
    ),
    "demo": ([], {**_STEPS, "-o": _OUTPUTS}),
    "bench": ([st.one_of(st.none(), _SEVERAL)], {"--updates": _number("1", "10")}),
    "covariance": (
        [st.one_of(st.none(), _SEVERAL)],
        {"--updates": _number("1", "10"), "--log": _LOGS},
    ),
    "monitor": (
        [st.one_of(st.just("capture.bin"), _PATHS, _TEXTS)],
        {
            "--baud": _number("9600"),
            "--count": _number("1", "2"),
            "--csv": _OUTPUTS,
            "--plot": st.one_of(_TEXTS, st.sampled_from(["out.png", "out.gif", "log.csv/out.pdf"])),
            "--read": _mostly("gain", "mode", "flags", "7", "0x10", "5000"),
            "--write": st.one_of(
                st.builds("{}={}".format, _mostly("gain", "mode", "7", "flags"), _number("1")),
                _mostly("mode=fast", "gain"),
            ),
            "--map": st.one_of(st.just("map.json"), _PATHS),
        },
    ),
    "montecarlo": (
        [_mostly("world.py:World", "world.py"), _NAMES],
        {
            **_WORDS,
            **_STEPS,
            "--runs": _number("2"),
            "--seed": _number("1"),
            "--on": _mostly("c", "fixed", "float", "rtl"),
            "--jobs": _number("1"),
            "-o": _OUTPUTS,
        },
    ),
    "simulate": (
        [st.one_of(st.none(), _mostly("mekf", "ekf_bias")), st.one_of(st.none(), _LOGS)],
        {
            **_MODEL,
            "--seconds": _number("0.05", "1"),
            "--source": _mostly("heading", "counts"),
            "--faults": None,
            "-o": _OUTPUTS,
        },
    ),
}


@st.composite
def command_lines(draw: st.DrawFn, *only: str) -> list[str]:
    """A command line of one of the verbs (all by default), or of none."""
    if not only and draw(st.integers(0, 49)) == 0:
        return draw(
            st.lists(st.one_of(_TEXTS, st.sampled_from(["--help", "--version"])), max_size=3)
        )
    verb = draw(st.sampled_from(only or sorted(VERBS)))
    positional, options = VERBS[verb]
    words = [w for w in map(draw, positional) if w is not None]
    for name in draw(st.lists(st.sampled_from([*sorted(options), "--json", "-q"]), max_size=3)):
        value = options.get(name)
        words += [name] if value is None else _pair(name, draw(value), draw(st.booleans()))
    if draw(st.integers(0, 19)) == 0 and words:
        words.pop(draw(st.integers(0, len(words) - 1)))
    return [verb, *words]


def _pair(name: str, value: str, joined: bool) -> list[str]:
    return [f"{name}={value}"] if joined and name.startswith("--") else [name, value]
