"""A counterexample as text: changes of signals, cycle by cycle."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Trace", "read_trace"]

#: Time steps of the file per clock cycle; the clock falls at half of it.
_STEP = 10
_TOOL_SIGNALS = ("smt_clock", "smt_step", "clk")


@dataclass(frozen=True)
class Trace:
    """Values of named signals over the cycles of a run.

    Attributes
    ----------
    values : dict of str to tuple of int
        For each signal (``part.name``) one value per cycle. Bits that may be anything are 0.
    """

    values: dict[str, tuple[int, ...]]

    @property
    def cycles(self) -> int:
        """Cycles of the run."""
        return max((len(values) for values in self.values.values()), default=0)

    def text(self, *, last: int = 40, parts: bool = True) -> str:
        """One line per cycle with the signals that changed, the first line with all.

        Parameters
        ----------
        last : int
            Only so many cycles up to the end.
        parts : bool
            Also signals inside of the parts, not only the harness's own.
        """
        names = sorted(
            (n for n in self.values if parts or "." not in n), key=lambda n: (n.count("."), n)
        )
        first = max(self.cycles - last, 0)
        lines = []
        for cycle in range(first, self.cycles):
            changes = [
                f"{name}={self.values[name][cycle]:#x}"
                for name in names
                if cycle == first or self.values[name][cycle] != self.values[name][cycle - 1]
            ]
            lines.append(f"{cycle:5d}: " + (" ".join(changes) or "-"))
        return "\n".join(lines)


def read_trace(vcd: str) -> Trace:
    """Read the value change dump of a run of smtbmc; signals without a proper name are left out."""
    names: dict[str, list[str]] = {}
    scope: list[str] = []
    current: dict[str, int] = {}
    history: dict[str, list[int]] = {}
    for line in vcd.splitlines():
        kind, *rest = line.split() or [""]
        if kind == "$scope":
            scope.append(rest[1])
        elif kind == "$upscope":
            scope.pop()
        elif kind == "$var":
            code, name = rest[2], rest[3]
            if name not in _TOOL_SIGNALS and "$" not in name and not name.startswith("_"):
                # The first scope, or two, are the harness itself.
                parts = scope[2:] if scope[1:2] == ["harness"] else scope[1:]
                names.setdefault(code, []).append(".".join([*parts, name]))
                history.setdefault(code, [])
        elif kind.startswith("#"):
            if int(kind[1:]) % _STEP:
                for code, values in history.items():
                    values.append(current.get(code, 0))
        elif kind.startswith("b"):
            current[rest[0]] = int("".join("1" if c == "1" else "0" for c in kind[1:]), 2)
        elif kind[:1] in tuple("01xz"):
            current[kind[1:]] = int(kind[0] == "1")
    signals = {name: tuple(history[code]) for code, aliases in names.items() for name in aliases}
    return Trace(
        {
            name: trace
            for name, trace in signals.items()
            if not any(other.endswith(f".{name}") and signals[other] == trace for other in signals)
        }
    )
