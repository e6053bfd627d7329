"""A design on a target: its area, its clock, estimated or routed, and the block RAM of a core."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import count
from operator import and_, or_
from typing import Any, Final

from boresight.gateware.machine import Machine
from boresight.gateware.microcode.image import Image, data_memories
from boresight.gateware.synthesis import tools
from boresight.gateware.synthesis.family import ClockEstimate, Family, Target
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError

#: Default clock that the router works towards: higher than any core reaches, MHz.
_CLOCK_MHZ: Final = 200.0


@dataclass(frozen=True, kw_only=True)
class Mapped:
    """A netlist on a target, before placement."""

    target: Target
    #: As yosys writes it, flip-flops in the registers of multipliers and memories.
    netlist: dict[str, Any]
    #: Resources used, by the keys of the target's.
    used: Mapping[str, float]
    #: Of yosys.
    version: str
    #: Estimate of the clock, of families that have one.
    clock: ClockEstimate | None = None

    @property
    def amounts(self) -> str:
        return ", ".join(f"{n:,g} {self.target.device.unit(key)}" for key, n in self.used.items())

    def __str__(self) -> str:
        text = f"{self.amounts} (cells of the netlist for {self.target.title}, not placed)"
        return f"{text}; clock {self.clock.band}" if self.clock is not None else text


@dataclass(frozen=True, kw_only=True)
class Routed:
    """A design placed and routed with several seeds."""

    mapped: Mapped
    #: One for each seed.
    runs: tuple[tools.Run, ...]
    #: Of the router.
    version: str

    @property
    def clock_mhz(self) -> float | None:
        """Clock of the worst seed, rounded down to 0.1 MHz; None if nothing limits it."""
        clocks = [run.clock_mhz for run in self.runs if run.clock_mhz is not None]
        return int(10.0 * min(clocks)) / 10 if clocks else None

    @property
    def seeds(self) -> str:
        numbers = [run.seed for run in self.runs]
        return f"seed {numbers[0]}" if len(numbers) == 1 else f"seeds {numbers[0]} to {numbers[-1]}"

    @property
    def source(self) -> str:
        return f"routed on {self.mapped.target.title}, {self.version}, worst of {self.seeds}"

    def __str__(self) -> str:
        return f"{self.mapped.amounts}; clock {self.clock_mhz} MHz ({self.source})"


def netlist_for(verilog: str, top: str, target: Target) -> Mapped:
    """Synthesise for a target: its netlist, the resources that it uses, a clock estimate.

    Flip-flops move into the registers of multipliers and memories.

    Raises ToolMissing, SynthesisError if yosys rejected the design, InputError if the part is too
    small.
    """
    family = target.family
    netlist = tools.synthesise(verilog, top=top, command=family.synthesis)
    family.absorb(netlist, top)
    used = dict.fromkeys(("lut", "ff", "dsp", target.device.memory), 0.0)
    types = Counter(cell["type"] for cell in netlist["modules"][top]["cells"].values())
    for kind, number in types.items():
        if kind.startswith("$"):
            continue
        if kind not in family.cells:
            raise tools.SynthesisError(f"cell type must be one of {family.title}, not {kind!r}")
        for key, each in family.cells[kind].items():
            used[key] = used.get(key, 0.0) + each * number
    _check_room(used, target)
    return Mapped(
        target=target,
        netlist=netlist,
        used=used,
        version=tools.find_tool().version,
        clock=family.estimate(netlist, top, target.grade),
    )


def _check_room(used: Mapping[str, float], target: Target, *, why: str = "") -> None:
    """Raise InputError if a part has too little of something."""
    device = target.device
    over = [key for key, n in used.items() if n > device.capacity(key)]
    if not over:
        return
    family = (t for t in TARGETS.values() if t.family.name == target.family.name)
    fits = (t.name for t in family if all(n <= t.device.capacity(k) for k, n in used.items()))
    otherwise = "another family or a narrower --word, or compile less"
    raise InputError.at(
        f"target {target.name}",
        wanted=", ".join(f"{device.capacity(k):,} {device.unit(k)}" for k in over),
        found=", ".join(f"{used[k]:,g} ({used[k] - device.capacity(k):,g} too many)" for k in over),
        fix=f"{why}choose {next(fits, otherwise)}",
    )


def implement(
    verilog: str,
    top: str,
    target: Target,
    *,
    seeds: int = 1,
    clock_mhz: float | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Routed:
    """Synthesise, place and route a design between flip-flops (`enclosed`), with seeds 1, 2, ...

    ``top`` is its module with the clock ``clk``; the family of ``target`` has a router, which works
    towards ``clock_mhz``. Raises as `netlist_for`, and RouteError if it rejected the design.
    """
    tools.find_router(target.router)  # before the work
    mapped = netlist_for(verilog, top, target)
    inner = enclosed(mapped.netlist, top, target.family)
    return route(mapped, inner, clock_mhz or _CLOCK_MHZ, seeds, progress=progress)


def route(
    mapped: Mapped,
    netlist: Mapping[str, Any],
    clock_mhz: float,
    seeds: int,
    *,
    progress: Callable[[str], None],
    **options: Any,
) -> Routed:
    """Place and route a netlist with seeds 1, 2, ...; ``options`` as of `place_and_route`."""
    target, runs = mapped.target, []
    tool = tools.find_router(target.router)
    for seed in range(1, seeds + 1):
        progress(f"{tool.version}, {target.title}, seed {seed}")
        run = tools.place_and_route(netlist, target, seed=seed, clock_mhz=clock_mhz, **options)
        runs.append(run)
    return Routed(mapped=mapped, runs=tuple(runs), version=tool.version)


def enclosed(netlist: dict[str, Any], top: str, family: Family) -> dict[str, Any]:
    """The netlist with a flip-flop in place of every bit of its ports but the clock, ``clk``.

    Inputs come out of a shift register, outputs end in flip-flops: paths through ports are routed,
    and timed as if registers were beside the design. What drives the clock, and constants, is as
    `Family.drivers` says.
    """
    out = copy.deepcopy(netlist)
    module = out["modules"][top]
    cells, ports = module["cells"], module["ports"]
    beside, *_ = family.flip_flops
    (clock_net,) = ports["clk"]["bits"]
    connected = [bits for cell in cells.values() for bits in cell["connections"].values()]
    connected += [port["bits"] for port in ports.values()]
    fresh = count(1 + max(bit for bits in connected for bit in bits if isinstance(bit, int)))

    def drive(signal: str, net: int) -> int:
        cell_type, settings, output = family.drivers[signal]
        cells[f"$drive${signal}"] = _cell(cell_type, settings, {}, {output: net})
        return net

    before: int | str = drive("0", next(fresh)) if "0" in family.drivers else "0"
    module["ports"] = {"clk": ports.pop("clk")}
    if "clk" in family.drivers:
        drive("clk", clock_net)
        module["ports"] = {}
    for name, port in ports.items():
        for number, net in enumerate(port["bits"]):
            if not isinstance(net, int):
                continue
            entering = port["direction"] == "input"
            inputs = {beside.clock: clock_net, beside.d: before if entering else net}
            output = {beside.q: net if entering else next(fresh)}
            before = net if entering else before
            cells[f"$port${name}${number}"] = _cell(beside.kind, beside.parameters, inputs, output)
    return out


def _cell(
    kind: str,
    parameters: Mapping[str, str],
    inputs: Mapping[str, int | str],
    outputs: Mapping[str, int],
) -> dict[str, Any]:
    return {
        **{"hide_name": 1, "type": kind, "parameters": dict(parameters), "attributes": {}},
        "port_directions": {**dict.fromkeys(inputs, "input"), **dict.fromkeys(outputs, "output")},
        "connections": {port: [net] for port, net in {**inputs, **outputs}.items()},
    }


#: Ways to use a block: (words, bits) -> blocks, halves where a block can be divided.
Shapes = Mapping[tuple[int, int], float]


def least_blocks(words: int, bits: int, shapes: Shapes) -> float:
    """Fewest blocks for a memory, made of columns of blocks of one shape each."""
    columns = [(width, each * -(-words // depth)) for (depth, width), each in shapes.items()]
    cost = [0.0]
    for remaining in range(1, bits + 1):
        cost.append(min(each + cost[max(0, remaining - width)] for width, each in columns))
    return cost[bits]


def core_blocks(machine: Machine, image: Image, shapes: Shapes) -> tuple[float, float]:
    """Blocks of the microcode, and of registers and tables; at least.

    Bits that are the same in all words of a memory of microcode are none of its columns.
    """
    microcode = 0.0
    for words in image.hardware_rom(machine):
        varying = reduce(or_, words) & ~reduce(and_, words)
        microcode += least_blocks(len(words), varying.bit_count(), shapes)
    data, word = data_memories(machine, image).values(), machine.arithmetic.word
    return microcode, sum(least_blocks(len(words), word, shapes) for words in data)


def check_memory(machine: Machine, image: Image, target: Target) -> None:
    """Raise InputError, with the core's need, if a part has too little block RAM."""
    microcode, data = core_blocks(machine, image, target.family.memory_shapes)
    take = (
        f"{len(image.rom):,} microwords of {machine.word_bits} bits take {microcode:g}, "
        f"{machine.register_words:,} registers and the tables {data:g}: "
    )
    used = {target.device.memory: microcode + data}
    _check_room(used, target, why=take)
