"""The mutator: what it changes, where, and that it counts only what it should."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.mutants.campaign import Done, Record, run, sample, unsound
from tests.mutants.edits import Mutant
from tests.mutants.equivalent import equivalents, stale
from tests.mutants.groups import GROUPS, all_mutants, nearest_tests, wider_tests
from tests.mutants.hardware import hardware_mutants
from tests.mutants.page import figures, render
from tests.mutants.software import software_mutants
from tests.mutants.trial import Verdict, run_tests, try_mutant
from tests.mutants.witnesses import PARTS, WITNESSES

ROOT = Path(__file__).parents[2]

HARDWARE = '''
class Part(Component):
    """Text == 1."""

    def elaborate(self, platform):
        """Text + 1."""
        m = Module()
        kind = Signal(8, init=-1)  # ä
        if width < 1:
            raise ValueError(f"{width + 1}")
        m.d.sync += [kind.eq(Mux(a, b, c)), d.eq((a == b) & ~e)]
        with m.FSM(), m.State("A"):
            with m.If(
                a
                & b
            ):
                m.next = "B"
        return m

    def plain(self):
        return 1 + 1
'''
SOFTWARE = '''
def f(a, b: int = 1) -> int:
    """Text == 1."""
    assert a < 1
    if a < 3 and not b:
        done.append(g(a, b))
    return max(a, -1) if (a == b) else True
'''


def changes(mutants: list[Mutant]) -> set[tuple[str, str, str]]:
    return {(m.kind, m.old, m.new) for m in mutants}


def test_faults_of_hardware() -> None:
    result = hardware_mutants("part.py", HARDWARE)
    assert changes(result) == {
        ("width", "8", "7"),
        ("number", "8", "9"),
        ("reset value", "-1", "0"),
        ("number", "1", "2"),
        ("dropped assignment", "kind.eq(Mux(a, b, c))", "*()"),
        ("dropped assignment", "d.eq((a == b) & ~e)", "*()"),
        ("swapped choice", "Mux(a, b, c)", "Mux(a, c, b)"),
        ("operator", "(a == b) & ~e", "(a == b) | ~e"),
        ("comparison", "a == b", "a != b"),
        ("inversion left out", "~e", "e"),
        ("inverted condition", "a & b", "(a & b) == 0"),
        ("operator", "a & b", "a | b"),
        ("dropped next state", "m.next = 'B'", "pass"),
    }


def test_faults_of_software() -> None:
    assert changes(software_mutants("f.py", SOFTWARE)) == {
        ("inverted condition", "a < 3 and (not b)", "not (a < 3 and not b)"),
        ("and, or", "a < 3 and (not b)", "((a < 3) or (not b))"),
        ("condition left out", "a < 3 and (not b)", "((a < 3))"),
        ("condition left out", "a < 3 and (not b)", "((not b))"),
        ("comparison", "a < 3", "a <= 3"),
        ("number", "3", "4"),
        ("inversion left out", "not b", "(b)"),
        ("dropped statement", "done.append(g(a, b))", "pass"),
        ("swapped arguments", "g(a, b)", "g(b, a)"),
        ("opposite", "max", "min"),
        ("number", "1", "2"),
        ("number", "True", "False"),
        ("comparison", "a == b", "a != b"),
        (
            "swapped choice",
            "max(a, -1) if a == b else True",
            "((True) if (a == b) else (max(a, -1)))",
        ),
    }


def test_an_edit_changes_its_place_and_no_other() -> None:
    for mutants, text in ((hardware_mutants, HARDWARE), (software_mutants, SOFTWARE)):
        for m in mutants("x.py", text):
            changed = m.apply(text)
            ast.parse(changed)
            begin = len(text.encode()[: m.start].decode())
            assert changed[:begin] == text[:begin]
            tail = text.encode()[m.end :].decode()
            assert changed == text[:begin] + m.new + tail


def test_keys_outlive_what_stands_around_the_edit() -> None:
    """Lines above, another statement around the same fragment: the same keys. Each key once."""
    other = "# a line\n\n" + HARDWARE.replace(
        "kind = Signal(8, init=-1)", "kinds = [\n            Signal(8, init=-1)]"
    )
    keys = [m.key for m in hardware_mutants("part.py", HARDWARE)]
    assert [m.key for m in hardware_mutants("part.py", other)] == keys
    twice = SOFTWARE.replace("a < 3", "a < 3 < 3")
    keys = [m.key for m in software_mutants("f.py", twice)]
    assert len(keys) == len(set(keys)) and any(key.endswith("3 -> 4 (2)") for key in keys)


@pytest.mark.parametrize("name", GROUPS)
def test_mutants_of_the_project(name: str) -> None:
    group = GROUPS[name]
    mutants = all_mutants(ROOT, group)
    assert len(mutants) > 2000
    assert len({m.key for m in mutants}) == len(mutants)
    first, again, other = (sample(ROOT, name, group, seed, 30) for seed in (7, 7, 8))
    assert first == again != other
    file = mutants[-1].file
    assert {m.file for m in sample(ROOT, name, group, 7, 3, only=file)} == {file}
    assert len({m.file for m in mutants}) > 30


def test_parts_and_what_runs_a_witness_alone() -> None:
    """The parts share no file; what a witness runs is there."""
    files = {name: set(files(ROOT)) for name, (files, _) in PARTS.items()}
    assert all(files.values()) and sum(map(len, files.values())) == len(
        set().union(*files.values())
    )
    assert "gateware/schedule/allocate.py" in files["allocator"]
    for witness in WITNESSES.values():
        for file in set().union(*files.values()):
            name, _, test = witness(ROOT, file)[0].partition("::")
            assert f"def {test}" in (ROOT / name).read_text("utf-8")


def test_every_file_has_tests() -> None:
    for files, _ in GROUPS.values():
        for file in files(ROOT):
            nearest, wider = nearest_tests(ROOT, file), wider_tests(ROOT, file)
            tests = [*nearest, *wider]
            assert tests and len(set(tests)) == len(tests), file
            assert all((ROOT / name.partition("::")[0]).exists() for name in tests), file
    assert nearest_tests(ROOT, "gateware/sensors/adis16385.py") == [
        "tests/gateware/sensors/test_adis16385.py",
        "tests/gateware/sensors/test_adis16385_faults.py",
    ]
    assert "tests/gateware/engine/test_engine.py" in wider_tests(
        ROOT, "gateware/engine/sequencer.py"
    )
    proof = "tests/sim/formal/test_prove.py::test_short_proof[axi.lite]"
    assert proof in wider_tests(ROOT, "gateware/bus/axi_lite.py")
    assert proof not in wider_tests(ROOT, "gateware/bus/wishbone.py")


def test_equivalent_mutants_have_a_reason(tmp_path: Path) -> None:
    assert len(equivalents()) > 80
    assert stale({"gone": "x", "here": "y"}, ["here"]) == ["gone"]
    file = tmp_path / "list.toml"
    for text in ('"" = ["a"]', 'x = ["a", "a"]', 'x = ["a"]\ny = ["a"]'):
        file.write_text(text)
        with pytest.raises(ValueError, match=r"^list\.toml: every mutant once, each with"):
            equivalents(file)


# -- a tree of one function ------------------------------------------------------------------------

CODE = """\
def f(a, b):
    if a < b:
        return 1
    return 0


def spin(n):
    while n > 0:
        n -= 1
    return 5
"""
NEAR = """\
from gateware.code import f, spin
def test_f():
    assert f(1, 2) == 1 and spin(3) == 5
"""
WIDE = """\
from gateware.code import f
def test_all():
    assert f(2, 1) == 0
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for folder in ("tests", "gateware", "boresight", "firmware", "model", "sim", "systems"):
        (tmp_path / "tree" / folder).mkdir(parents=True)
    for name, text in (
        ("gateware/__init__.py", ""),
        ("gateware/code.py", CODE),
        ("tests/test_near.py", NEAR),
        ("tests/test_wide.py", WIDE),
    ):
        (tmp_path / "tree" / name).write_text(text)
    return tmp_path / "tree"


def of(statement: str, new: str) -> Mutant:
    """The mutant of `CODE` that makes this of a statement or of a part of it."""
    mutants = software_mutants("gateware/code.py", CODE)
    (result,) = (m for m in mutants if (m.statement, m.new) == (statement, new))
    return result


@pytest.mark.parametrize(
    "statement, new, limit_s, verdict",
    [
        ("return 1", "2", 120, Verdict("nearest", "tests/test_near.py::test_f")),
        ("return 0", "1", 120, Verdict("wider", "tests/test_wide.py::test_all")),
        ("if a < b:", "a <= b", 120, Verdict("survived")),
        ("n -= 1", "pass", 2, Verdict("time")),
        ("return 5", "6", 120, Verdict("nearest", "tests/test_near.py::test_f")),
    ],
)
def test_verdicts(tree: Path, statement: str, new: str, limit_s: float, verdict: Verdict) -> None:
    result = try_mutant(
        tree,
        of(statement, new),
        ["tests/test_near.py"],
        ["tests/test_wide.py"],
        limit_s=limit_s,
        cache=tree.parent,
    )
    assert result == verdict
    assert (tree / "gateware/code.py").read_text() == CODE


def test_memory_without_end_is_noticed(tree: Path) -> None:
    """It is the machine's that others need, too."""
    (tree / "tests/test_much.py").write_text("def test_much():\n    bytearray(9 << 30)\n")
    code, by = run_tests(tree, ["tests/test_much.py"], 60, tree.parent)
    assert (code, by) == (1, "tests/test_much.py::test_much")


def test_tests_that_cannot_be_run_say_nothing(tree: Path) -> None:
    """Neither noticed nor survived; the next run tries again."""
    mutant = of("if a < b:", "a <= b")
    verdict = try_mutant(tree, mutant, ["tests/gone.py"], [], limit_s=60, cache=tree.parent)
    assert verdict == Verdict("error", "exit code 4") and not verdict.noticed
    row = figures([Done("compiler", mutant, verdict)], "compiler")
    assert (row["tried"], row["noticed"], row["survived"], row["error"]) == (0, 0, 0, 1)
    record = Record(tree.parent / "verdicts.jsonl", tree)
    noticed = Verdict("nearest", "tests/test_near.py::test_f")
    for before, value in ((noticed, noticed), (verdict, None), (noticed, noticed)):
        record.add(mutant, before)
        assert Record(record.path, tree).find(mutant) == value


def test_a_run_goes_on_where_it_was_cut_off(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Verdicts are kept; a survivor is tried again when there are other tests, all of them when
    there is other code; the order and the number of workers change nothing."""
    tried: list[str] = []

    def verdict(root: Path, mutant: Mutant, *_: object, **__: object) -> Verdict:
        tried.append(mutant.key)
        return Verdict("survived" if mutant.new == "pass" else "nearest", "tests/test_near.py")

    monkeypatch.setattr("tests.mutants.campaign.try_mutant", verdict)
    mutants = software_mutants("gateware/code.py", CODE)
    known = {mutants[0].key: "because"}
    path = tree.parent / "verdicts.jsonl"

    def go(jobs: int) -> list[Done]:
        tried.clear()
        return run(
            tree,
            {"compiler": mutants},
            known,
            Record(path, tree),
            jobs=jobs,
            limit_s=1,
            cache=tree,
            say=lambda text: None,
            witness=lambda root, file: [],
        )

    first = go(1)
    assert len(tried) == len(mutants) - 1 == len(first) and mutants[0].key not in tried
    assert go(3) == first and tried == []
    (tree / "tests/test_more.py").write_text("")
    survivors = [d.mutant.key for d in first if not d.verdict.noticed]
    assert go(1) == first and tried == survivors and survivors
    (tree / "gateware/more.py").write_text("")
    assert go(2) == first and len(tried) == len(first)
    row = figures(first, "compiler")
    assert row["tried"] == len(first) and row["survived"] == len(survivors)
    assert row["noticed"] == row["nearest"] == row["tried"] - row["survived"]
    page = render(first, {"compiler": mutants}, known, seed=3, command="make mutants")
    assert all(f"key: {key}" in page for key in (*survivors, *known)) and "because" in page


def test_tests_that_fail_anyway_are_found(tree: Path) -> None:
    (tree / "pytest.ini").write_text("[pytest]\nmarkers = soak\naddopts = -m 'not soak'\n")
    (tree / "tests/test_bad.py").write_text("def test_bad():\n    assert False\n")
    slow = "import pytest\n@pytest.mark.soak\ndef test_slow():\n    pass\n"
    (tree / "tests/test_slow.py").write_text(slow)
    mutant = of("if a < b:", "a <= b")
    for by, wanted in (
        ("tests/test_near.py::test_f", ""),
        ("tests/test_slow.py::test_slow", ""),
        ("tests/test_bad.py::test_bad", "tests/test_bad.py::test_bad"),
    ):
        done = [Done("compiler", mutant, Verdict("nearest", by))]
        assert unsound(tree, done, limit_s=60, cache=tree) == wanted
