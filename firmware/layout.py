"""Layout of the emitted C: banner sections, blocks, file heads."""

from __future__ import annotations

from collections.abc import Iterable

from boresight.firmware.body import Body
from boresight.firmware.names import comment

__all__ = ["END", "banner", "block", "head", "join"]

_RULE = "//" + 78 * "-"

#: Last lines of a file.
END = f"{_RULE}\n// End of file"


def banner(title: str) -> str:
    """Heading of a section."""
    return f"{_RULE}\n// {title}"


def block(opening: str, lines: Iterable[str]) -> str:
    """Indented lines in braces."""
    return "\n".join([f"{opening} {{", *(f"    {line}" if line else "" for line in lines), "}"])


def join(*parts: str) -> str:
    """A file: parts that are not empty, apart by one blank line."""
    return "\n\n".join(part for part in parts if part) + "\n"


def head(body: Body, suffix: str, brief: str) -> str:
    """First comment of a file."""
    p = body.program
    return (
        f"/**\n * @file {body.name}{suffix}\n * @brief {brief}\n *\n"
        f' * Generated from the program "{comment(p.name)}"; do not edit.\n'
        f" * Program digest: {p.digest}\n */"
    )
