"""The page of an experiment: targets with their verdicts, tables, figures, nothing from outside."""

from boresight.sim.experiments.experiment import Target
from boresight.sim.experiments.page import Section, numbers, render


def page() -> str:
    targets = [
        Target(name="one", source="step 1", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="two <b>", part="x", source="step 2", value=0.5, low=2.0, spread=(0.25, 0.75)),
        Target(name="three", source="step 3", value=0.25, unit="deg", beside={"paper": 9.0}),
    ]
    sections = [
        Section(title="Table", text="Some text.", columns=("case", "a"), rows=[["good", 0.0123]]),
        Section(title="Plot", figures=[("what it shows", "<svg>drawn</svg>")]),
    ]
    return render("own", ["Beginning.", "More."], targets, sections)


def test_targets() -> None:
    text = page()
    assert text.count('class="ok"') == 1 == text.count('class="bad"')
    assert "Targets met: 1 of 2." in text  # what has no limits is shown, not judged
    assert "two &lt;b&gt;, x" in text and "&ge; 2" in text and "&le; 1" in text
    assert ">note" not in text and "(reported)" not in text
    assert "0.25 to 0.75" in text and "0.25 deg" in text
    assert '<th class="r">prototype' in text and '<th class="r">paper' in text


def test_what_is_reported_only() -> None:
    missed = Target(name="n", source="s", value=3.0, high=2.0, binding=False, note="limited so")
    text = render("own", [], [missed], [])
    assert "FAIL</span> (reported)" in text and ">note" in text and "limited so" in text


def test_sections() -> None:
    text = page()
    for wanted in ("<h2>Table</h2>", "Some text.", "<th>case", ">0.0123<", "<svg>drawn</svg>"):
        assert wanted in text, wanted
    assert "<figcaption>what it shows" in text and "Beginning." in text and "More." in text


def test_nothing_from_outside() -> None:
    assert "http" not in page() and "<script" not in page() and page() == page()


def test_numbers_of_one_cell() -> None:
    assert numbers([1.0, -2.345]) == "1.00, \N{MINUS SIGN}2.35"  # -2.345 lies just below
    assert numbers([0.00123, -4e-9], ".1e") == (
        "1.2e\N{MINUS SIGN}03, \N{MINUS SIGN}4.0e\N{MINUS SIGN}09"
    )
