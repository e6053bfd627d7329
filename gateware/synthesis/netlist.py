"""A flattened gate-level netlist, read from the JSON that yosys writes.

Nets are single bits with an integer number; constant bits are the strings ``0``, ``1``, ``x`` and
``z``. A :class:`Pin` is one bit of one port of one cell.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

Bit = int | str


class NetlistError(ValueError):
    """The netlist cannot be read by this package."""


class Pin(NamedTuple):
    """Bit ``offset`` of port ``port`` of cell ``cell``."""

    cell: str
    port: str
    offset: int


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One instance.

    Attributes
    ----------
    name : str
        Instance name.
    type : str
        Primitive name, e.g. ``LUT6``.
    inputs, outputs : mapping
        Port name -> bits, least significant first.
    params : mapping
        Parameter name -> value as yosys wrote it.
    src : str
        First source location outside the yosys library, or an empty string.
    """

    name: str
    type: str
    inputs: Mapping[str, tuple[Bit, ...]]
    outputs: Mapping[str, tuple[Bit, ...]]
    params: Mapping[str, object]
    src: str

    def number(self, param: str, default: int) -> int:
        """Return an integer parameter; yosys leaves parameters with default values out."""
        value = self.params.get(param)
        if value is None:
            return default
        if isinstance(value, int):
            return value
        if isinstance(value, str) and value and set(value) <= {"0", "1"}:
            return int(value, 2)
        raise NetlistError(
            f"parameter {param} of cell {self.name} must be an integer, not {value!r}"
        )

    def text(self, param: str, default: str) -> str:
        """Return a string parameter."""
        value = self.params.get(param, default)
        if not isinstance(value, str):
            raise NetlistError(
                f"parameter {param} of cell {self.name} must be a string, not {value!r}"
            )
        return value.strip()


@dataclass(frozen=True, kw_only=True)
class Netlist:
    """The top module.

    Attributes
    ----------
    top : str
        Module name.
    cells : mapping
        Instance name -> cell, bookkeeping cells of yosys left out.
    output_bits : tuple of int
        Net bits that leave through a port of the module.
    names : mapping
        Net bit -> readable name.
    """

    top: str
    cells: Mapping[str, Cell]
    output_bits: tuple[int, ...]
    names: Mapping[int, str]

    @cached_property
    def drivers(self) -> Mapping[int, Pin]:
        """Net bit -> the output pin that drives it; bits from input ports are absent."""
        pins: dict[int, Pin] = {}
        for cell in self.cells.values():
            for port, bits in cell.outputs.items():
                for index, bit in enumerate(bits):
                    if not isinstance(bit, int):
                        continue
                    if bit in pins:
                        raise NetlistError(
                            f"net {self.name_of(bit)} must have one driver, not both "
                            f"{pins[bit].cell}.{pins[bit].port} and {cell.name}.{port}"
                        )
                    pins[bit] = Pin(cell.name, port, index)
        return pins

    @cached_property
    def loads(self) -> Mapping[int, tuple[Pin, ...]]:
        """Net bit -> the input pins it feeds."""
        loads: dict[int, list[Pin]] = {}
        for cell in self.cells.values():
            for port, bits in cell.inputs.items():
                for index, bit in enumerate(bits):
                    if isinstance(bit, int):
                        loads.setdefault(bit, []).append(Pin(cell.name, port, index))
        return {bit: tuple(pins) for bit, pins in loads.items()}

    def fanout(self, bit: int) -> int:
        """Return the number of pins on the net ``bit``, leaving the module counted as one."""
        return len(self.loads.get(bit, ())) + (bit in self.output_bits_set)

    def name_of(self, bit: int) -> str:
        """Return a readable name of the net ``bit``."""
        return self.names.get(bit, f"net#{bit}")

    @cached_property
    def output_bits_set(self) -> frozenset[int]:
        """The net bits that leave through a port of the module."""
        return frozenset(self.output_bits)

    @classmethod
    def from_json(cls, data: Mapping[str, Any], *, top: str | None = None) -> "Netlist":
        """Read the object that yosys ``write_json`` makes.

        Parameters
        ----------
        data : mapping
            The decoded JSON.
        top : str, optional
            Module to take; None takes the one with the ``top`` attribute.
        """
        modules = data.get("modules")
        if not isinstance(modules, Mapping) or not modules:
            raise NetlistError("netlist must have a non-empty 'modules' object")
        name = top if top is not None else _find_top(modules)
        if name not in modules:
            raise NetlistError(f"top must be a module of the netlist, not {name!r}")
        module = modules[name]
        cells = {
            cell_name: _read_cell(cell_name, raw)
            for cell_name, raw in module.get("cells", {}).items()
            if raw["type"] != "$scopeinfo"
        }
        outputs = tuple(
            bit
            for port in module.get("ports", {}).values()
            if port["direction"] != "input"
            for bit in port["bits"]
            if isinstance(bit, int)
        )
        names = _read_names(module.get("netnames", {}))
        return cls(top=name, cells=cells, output_bits=outputs, names=names)


def _find_top(modules: Mapping[str, Any]) -> str:
    marked = [n for n, m in modules.items() if _is_set(m.get("attributes", {}).get("top"))]
    if len(marked) == 1:
        return marked[0]
    if len(modules) == 1:
        return next(iter(modules))
    raise NetlistError(f"netlist must mark one module as top, not {len(marked)}")


def _is_set(value: object) -> bool:
    return value is not None and str(value).strip("0") != ""


def _read_cell(name: str, raw: Mapping[str, Any]) -> Cell:
    directions = raw.get("port_directions", {})
    inputs: dict[str, tuple[Bit, ...]] = {}
    outputs: dict[str, tuple[Bit, ...]] = {}
    for port, bits in raw.get("connections", {}).items():
        direction = directions.get(port)
        if direction not in ("input", "output", "inout"):
            raise NetlistError(
                f"port {port} of cell {name} ({raw['type']}) must have a direction, "
                f"not {direction!r}"
            )
        side = outputs if direction == "output" else inputs
        side[port] = tuple(bits)
    return Cell(
        name=name,
        type=raw["type"],
        inputs=inputs,
        outputs=outputs,
        params=raw.get("parameters", {}),
        src=_first_source(str(raw.get("attributes", {}).get("src", ""))),
    )


def _first_source(text: str) -> str:
    """Return the first of the ``|``-separated locations that is not in the cell library."""
    parts = [part for part in text.split("|") if part and "/share/" not in part]
    return parts[0] if parts else ""


def _read_names(netnames: Mapping[str, Any]) -> dict[int, str]:
    """Choose for each bit a name from the source, of several the shortest."""
    best: dict[int, tuple[tuple[bool, int, str], str]] = {}
    for name, raw in netnames.items():
        hidden = bool(raw.get("hide_name")) or name.startswith("$")
        bits = raw.get("bits", [])
        for index, bit in enumerate(bits):
            if not isinstance(bit, int):
                continue
            full = name if len(bits) == 1 else f"{name}[{index}]"
            rank = (hidden, len(full), full)
            if bit not in best or rank < best[bit][0]:
                best[bit] = (rank, full)
    return {bit: full for bit, (_, full) in best.items()}
