"""The verbs in docs/reference/commands.md, from their functions: ``make docs``.

What stands between `BEGIN` and `END` is written anew; a test says that it is current.
"""

from __future__ import annotations

from pathlib import Path

from boresight.cli import arguments_of, help_of
from boresight.verbs import VERBS

PAGE = Path(__file__).parents[1] / "reference" / "commands.md"
BEGIN = "<!-- from here written by `make docs` -->"
END = "<!-- to here written by `make docs` -->"


def section(name: str) -> str:
    """What is to be known of a verb."""
    summary, examples = help_of(name)
    width = max(len(line) for line, _ in examples)
    lines = [f"{line:{width}}  # {what}" for line, what in examples]
    shown = "\n".join(["<!-- parsed, not run: each verb has its tests -->", "```sh", *lines, "```"])
    parts = [f"### {name}", summary, shown]
    rows = [
        "| `{}` | {} |".format(argument.shown.replace("|", r"\|"), argument.text)
        for argument in arguments_of(name)
    ]
    if rows:
        parts.append("\n".join(["| argument | |", "|---|---|", *rows]))
    return "\n\n".join(parts)


def page(text: str) -> str:
    """The page, its part between the marks written anew."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n\n" + "\n\n".join(map(section, VERBS)) + f"\n\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
