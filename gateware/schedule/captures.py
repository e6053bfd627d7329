"""Captures that an op makes for later ops of its lane.

A lane's index, flag and count registers persist. A slot with a value on port ``a`` can capture it
for later ops in the lane, which then need no separate slot for it. Such a capture is a *gift*.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from boresight.gateware.schedule.arrange import needs, uses
from boresight.gateware.schedule.slots import Slot
from boresight.model.words.program import Op, Program

KINDS = ("index", "flag", "norm")
#: Content of a capture register: value, and whether a quarter was added.
Key = tuple[int, bool]


@dataclass(frozen=True)
class Gift:
    """The slot of ``term`` has the value of ``key`` on port a, or on b with ``swap``.

    ``kind`` is an index of `KINDS`.
    """

    kind: int
    key: Key
    term: int
    swap: bool


def keys(op: Op) -> tuple[Key | None, Key | None, Key | None]:
    """Required content of the lane's capture registers for an op."""
    pairs = ((op.index, op.index_quarter), (op.flag, op.flag_quarter), (op.norm, False))
    index, flag, norm = (
        (v, q) if required and v is not None else None
        for (v, q), required in zip(pairs, needs(op), strict=True)
    )
    return index, flag, norm


def gifts(program: Program) -> list[list[Gift]]:
    """For each op, the captures it could make for others."""
    wanted: dict[int, list[tuple[int, Key]]] = {}
    for op in program.ops:
        for kind, key in enumerate(keys(op)):
            if key is not None and (kind, key) not in wanted.setdefault(key[0], []):
                wanted[key[0]].append((kind, key))
    out = []
    for op in program.ops:
        offers = []
        for k in reversed(range(len(op.terms))):  # prefer late slots, with less effect on others
            t = op.terms[k]
            offers += [Gift(kind, key, k, False) for kind, key in wanted.get(t.a, ())]
            if t.b is not None and t.b != t.a:
                offers += [Gift(kind, key, k, True) for kind, key in wanted.get(t.b, ())]
        out.append(offers)
    return out


def give(
    slots: Sequence[Slot],
    op: Op,
    offers: Sequence[Gift],
    registers: list[Key | None],
    wish: Callable[[int, Key], bool],
) -> list[Slot]:
    """Add gifts to ``slots`` (one op's, in order) if ``wish`` accepts them; updates ``registers``.

    ``wish`` is called only for captures that do not disturb the op's terms.
    """
    out = list(slots)
    for gift in offers:
        kind, key = gift.kind, gift.key
        if registers[kind] == key:
            continue
        at = next(i for i, s in enumerate(out) if s.term == gift.term)
        s = out[at]
        last_use = max((i for i, x in enumerate(out) if uses(op, x.term)[kind]), default=-1)
        # An index serves the slots after its capture, the others the capturing slot too.
        if at < last_use or at == last_use and kind != 0:
            continue
        if any(getattr(x, f"cap_{KINDS[kind]}") for x in out[at:]):
            continue
        if s.swap != gift.swap:
            if s.cap_index or s.cap_flag or s.cap_norm:
                continue
            assert s.b is not None  # of two different values: a square's are never exchanged
            s = replace(s, a=s.b, b=s.a, swap=not s.swap)
        if kind != 2 and (s.cap_index or s.cap_flag) and s.quarter != key[1]:
            continue
        if not wish(kind, key):
            continue
        quarter = s.quarter if kind == 2 else key[1]
        out[at] = replace(s, **{f"cap_{KINDS[kind]}": True}, quarter=quarter)
        registers[kind] = key
    return out
