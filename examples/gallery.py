"""The table and the picture of `docs/learn/examples.md`: every world with its filter, in 26 bits.

Run it in this folder::

    python gallery.py -o gallery.png
"""

import argparse
import ast
import re
from pathlib import Path

import boresight

FOLDER = Path(__file__).parent
WORLDS = FOLDER / "worlds.py"
WORD = 26


def worlds():
    """Names of the worlds, in their order."""
    classes = [n for n in ast.parse(WORLDS.read_text()).body if isinstance(n, ast.ClassDef)]
    return [c.name for c in classes if c.name not in ("Sensors", "Loop")]


def file_of(world):
    """The filter of a world."""
    return FOLDER / f"{re.sub('(?<!^)(?=[A-Z])', '_', world).lower()}.py"


def author_lines(file):
    """Lines that are neither empty, nor imports, nor docstrings."""
    text = file.read_text()
    tree = ast.parse(text)
    left_out = set()
    for node in ast.walk(tree):
        doc = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if doc or isinstance(node, ast.Import | ast.ImportFrom):
            left_out |= {*range(node.lineno, node.end_lineno + 1)}
    lines = enumerate(text.splitlines(), 1)
    return sum(bool(line.split("#")[0].strip()) and n not in left_out for n, line in lines)


def checked(world, levels=("fixed",), **options):
    """Result of `check` of a world's filter on its world."""
    source = f"{WORLDS}:{world}"
    result = boresight.check(str(file_of(world)), source, levels=levels, word=WORD, **options)
    return result["results"][0]


def row(world, result):
    """Row of a result: file, lines, cycles, errors of the first output with a truth."""
    file = file_of(world)
    truth = {d.output: d for d in result.truth if d.samples}
    shown = {d.output: d for d in result.accuracy.differences}
    name = next(iter(truth or shown))
    near, schedule = shown[name], result.build.core.schedule
    unit = f" {near.unit}" if near.unit else ""
    off = f"{truth[name].rms:.2g}{unit}" if truth else "-"
    title = re.split(r"[:,.]| from ", file.read_text().strip('"'))[0]
    return (
        f"| [{title}](../../examples/{file.name}) | {author_lines(file)} | "
        f"{schedule.length} | {name}: {near.largest:.1e}{unit} | {off} |"
    )


def picture(path):
    """Estimate and truth of each world."""
    from matplotlib import pyplot

    names = worlds()
    rows = (len(names) + 3) // 4
    figure, axes = pyplot.subplots(rows, 4, figsize=(11, 1.7 * rows), layout="constrained")
    for axis, world in zip(axes.flat, [*names, *[None] * (4 * rows - len(names))], strict=True):
        axis.set_axis_off()
        if world is None:
            continue
        result = checked(world)
        outputs, truth = result.fixed.outputs, result.given.truth
        name = next(iter(truth or outputs))
        if truth:
            axis.plot(truth[name], color="tab:orange", linewidth=3, alpha=0.6)
        axis.plot(outputs[name], color="tab:blue", linewidth=1)
        unit = next(o.unit for o in result.build.estimators[0].outputs if o.name == name)
        axis.set_title(f"{file_of(world).stem}: {name} [{unit or 1}]", fontsize=9)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", metavar="FILE", help="draw the picture")
    arguments = parser.parse_args()
    for each in worlds():
        print(row(each, checked(each)))
    if arguments.o:
        picture(arguments.o)
