"""The page in a browser, by mouse and keyboard, and its logic without one."""

import dataclasses
import json
import shutil
import subprocess
from importlib.resources import files

import pytest

from boresight.sim.explore.demands import demands_of
from boresight.sim.explore.figures import FIGURES, ErrorFigures, Explored, Quantity
from boresight.sim.explore.page import page_data, render_page

NODE = shutil.which("node")
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")

ROWS = [
    Explored(
        "e",
        {},
        word,
        config,
        "xc6slx9",
        errors={"angle": ErrorFigures("deg", error, error, 0.1)},
        lut=lut,
        dsp=1 if word == 18 else 4,
        cycles=100,
        commands=(f"boresight compile e --word {word} --config {config}",),
    )
    for word, config, error, lut in (
        (18, "small", 1.0, 300),
        (24, "small", 0.01, 400),
        (24, "fast", 0.01, 800),
        (32, "small", float("nan"), 500),
    )
] + [
    Explored("e", {}, 20, "small", "xc6slx9", refused="</script> does not fit"),
    Explored("e", {}, 20, "fast", "xc6slx9", refused="no room", cycles=90),
]


def text(*, left: int = 0) -> str:
    known = [Quantity("angle", "angle: largest error from float64", "deg"), *FIGURES]
    known = [q for q in known if any(q.name in row.figures for row in ROWS)]
    demands = demands_of("angle<0.1", known)
    return render_page(page_data("e", ROWS, known, demands, known[2], ["a choice"], remaining=left))


def test_it_needs_nothing_from_elsewhere() -> None:
    page = text()
    assert "src=" not in page and "https:" not in page and "@import" not in page
    assert page.count("</script>") == 2, "a text of a row cannot end the script"


def test_how_far_an_estimated_clock_is_off_is_said() -> None:
    rows = [dataclasses.replace(ROWS[0], clock=128.4, clock_is="estimate")]
    said, unsaid = (page_data("e", r, [], [], None, [], remaining=0)["lines"] for r in (rows, ROWS))
    assert "1 to 41 % below the routed clock" in "".join(said) and not unsaid


@pytest.mark.skipif(NODE is None, reason="needs node (Debian: apt-get install nodejs)")
def test_logic(tmp_path) -> None:
    script = tmp_path / "page.js"
    script.write_text(files("boresight.sim.explore").joinpath("page.js").read_text())
    assert NODE is not None
    subprocess.run([NODE, "-e", LOGIC], check=True, cwd=tmp_path, timeout=60)


LOGIC = """
const assert = require("node:assert"), logic = require("./page.js");
const row = (x, y, more = {}) => ({ figures: { x, y }, ...more });
const rows = [row(1, 9), row(2, 5), row(3, 5), row(2, 8), row(4, 1), row(5, 2)];
const q = (name, more = false) => ({ name, more });
const at = (found) => found.map((r) => [r.figures.x, r.figures.y]);
assert.deepEqual(at(logic.front(rows, q("x"), q("y"))), [[1, 9], [2, 5], [4, 1]]);
assert.deepEqual(at(logic.front(rows, q("x"), q("y", true))), [[1, 9]]);
assert.equal(logic.front([row(1, 1), row(1, 1)], q("x"), q("y")).length, 2);
const d = (name, sign, limit) => [{ name, sign, limit }];
assert(logic.meets(row(1, 2), d("x", "<=", 1)) && !logic.meets(row(1, 2), d("x", "<", 1)));
assert(logic.meets(row(1, 2), d("y", ">=", 2)) && !logic.meets(row(1, 2), d("y", ">", 2)));
assert(!logic.meets(row(null, 2), d("x", "<", 9)));
assert(!logic.meets(row(1, 2), d("z", "<", 9)));
assert(logic.meets(row(1, 2), d("z", "<", NaN)) && !logic.meets(row(1, 2, { refused: "no" }), []));
const timed = { figures: { us: 2.6, rate: 4e5, cycles: 260, interval: 250 } };
assert.equal(logic.needed(timed, d("us", "<", 2)[0]), 130);
assert.equal(logic.needed(timed, d("rate", ">=", 5e5)[0]), 125);
assert(["us", "lut"].every((name) => isNaN(logic.needed(timed, d(name, "<", 3)[0]))));
const drawn = logic.shown([row(1, 0), row(1, null), row(0, 3)], "x", "y", [false, true]);
assert.deepEqual(at(drawn), [[0, 3]]);
const linear = [[[3, 900], false], [[7], false], [[0], false]];
for (const [values, log] of [...linear, [[3e-5, 2], true], [[7], true]]) {
  const axis = logic.axis(values, log);
  assert(axis.ticks.length >= 2 || log, JSON.stringify(axis));
  for (const v of axis.ticks) assert(Math.abs(logic.place(axis, v) - 0.5) <= 0.5 + 1e-9);
  for (const v of values) assert(logic.place(axis, v) > 0 && logic.place(axis, v) < 1);
}
assert.equal(logic.text(12345), "12\\u202f345");
assert.equal(logic.text(0.0123456), "0.01235");
assert.equal(logic.text(undefined), "\\u2014");
const axes = { x: "lut", y: "a.rms", logx: true, logy: false };
const set = { ...axes, demands: d("a", "<=", 0.5), at: "1, b", by: "-lut" };
assert.deepEqual(logic.restored(logic.address(set), { x: "", other: 1 }), { ...set, other: 1 });
assert.deepEqual(logic.restored("", { x: "k" }), { x: "k" });
"""

DRIVE = """
<script>
const seen = { errors: [] };
window.onerror = (message) => { seen.errors.push(String(message)); };
</script>
"""

ACTIONS = """
<script>
const $ = (what) => [...document.querySelectorAll(what)];
const named = (name) => $(`.point[data-name="${name}"]`)[0];
const key = (element, key) => element.dispatchEvent(new KeyboardEvent("keydown", { key }));
const set = (element, value, event) => {
  element.value = value;
  element.dispatchEvent(new Event(event));
};
seen.points = $(".point").map((p) => [p.dataset.name, p.classList.contains("out")]);
named("24 bits, fast, xc6slx9").dispatchEvent(new MouseEvent("mouseenter"));
seen.tip = document.getElementById("tip").innerText;
named("18 bits, small, xc6slx9").focus();
key(document.activeElement, "ArrowRight");
seen.next = document.activeElement.dataset.name;
key(document.activeElement, "Enter");
seen.detail = document.getElementById("detail").innerText;
seen.address = location.hash;
set($("input[aria-label='limit of angle']")[0], "2", "input");
seen.wider = $(".point.out").length;
seen.front = $(".front").length;
set(document.getElementById("more"), "dsp", "change");
seen.dsp = $("input[aria-label='limit of dsp']")[0].value;
set($("input[aria-label='limit of dsp']")[0], "1", "input");
seen.narrower = $(".point:not(.out)").map((p) => p.dataset.name);
$("button[aria-label='without the demand on dsp']")[0].click();
set(document.getElementById("x"), "word", "change");
$("#table th button")[$("#table th").findIndex((th) => th.innerText.startsWith("lut"))].click();
seen.sorted = $("#table tbody tr").map((tr) => tr.dataset.name);
seen.refused = $("#table .bad").map((td) => td.innerText);
seen.columns = $("#table tr").map((tr) => [...tr.cells].reduce((n, cell) => n + cell.colSpan, 0));
const result = document.createElement("pre");
result.id = "seen";
result.textContent = JSON.stringify(seen);
document.body.append(result);
</script>
"""


@pytest.mark.skipif(BROWSER is None, reason="needs Chromium (Debian: apt-get install chromium)")
def test_in_a_browser(tmp_path) -> None:
    page = tmp_path / "page.html"
    page.write_text(
        text().replace("<head>", f"<head>{DRIVE}").replace("</body>", f"{ACTIONS}</body>")
    )
    assert BROWSER is not None
    options = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}/user"]
    shown = subprocess.run(
        [BROWSER, *options, "--virtual-time-budget=2000", "--dump-dom", page.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
    ).stdout
    seen = json.loads(
        shown.partition('<pre id="seen">')[2]
        .partition("</pre>")[0]
        .replace("&lt;", "<")
        .replace("&gt;", ">")
    )
    assert seen["errors"] == []
    assert {tuple(p) for p in seen["points"]} == {
        ("18 bits, small, xc6slx9", True),
        ("24 bits, small, xc6slx9", False),
        ("24 bits, fast, xc6slx9", False),
    }
    assert seen["tip"].startswith("24 bits, fast") and "angle 0.01 deg" in seen["tip"]
    assert seen["next"] == "24 bits, small, xc6slx9"
    assert "boresight compile e --word 24 --config small" in seen["detail"]
    assert "at=24+bits" in seen["address"]
    assert seen["wider"] == 0 and seen["front"] == 1 and float(seen["dsp"]) == 4
    assert seen["narrower"] == ["18 bits, small, xc6slx9"]
    assert seen["sorted"][:2] == ["18 bits, small, xc6slx9", "24 bits, small, xc6slx9"]
    assert seen["refused"] == ["</script> does not fit", "no room"]
    assert len({*seen["columns"]}) == 1
