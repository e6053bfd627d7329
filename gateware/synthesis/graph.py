"""The timing graph of a netlist: nodes, hops between them, and where paths start and end.

Built once; delays come later as a table, so one graph serves every grade and net model.
"""

from collections import deque
from dataclasses import dataclass, field

from boresight.gateware.synthesis.arcs import CellTiming, Hop, Keys, Primitives
from boresight.gateware.synthesis.netlist import Cell, Netlist, NetlistError, Pin
from boresight.gateware.synthesis.spartan6.primitives import PRIMITIVES


@dataclass(frozen=True)
class Start:
    """A register drives node ``node`` after ``keys``."""

    node: int
    cell: str
    register: str
    keys: Keys


@dataclass(frozen=True)
class Edge:
    """From ``driver`` over a net to ``load``, then through the cell to node ``target``."""

    source: int
    target: int
    bit: int
    driver: Pin
    load: Pin
    hop: Hop
    keys: Keys
    fanout: int


@dataclass(frozen=True)
class Endpoint:
    """A path ends at a register.

    With ``load`` None the whole path lies inside ``cell``, from ``start`` to ``register``, and
    ``is_period`` says that it is a minimum clock period.
    """

    cell: str
    register: str
    keys: Keys
    source: int = -1
    bit: int = -1
    driver: Pin | None = None
    load: Pin | None = None
    hop: Hop | None = None
    fanout: int = 0
    start: str = ""
    is_period: bool = False


@dataclass
class Graph:
    """Timing graph of a netlist.

    Attributes
    ----------
    order : list of int
        Nodes, each after every node that feeds it.
    incoming : list of list of Edge
        Node -> edges into it.
    starts : list of list of Start
        Node -> registers that drive it.
    clocks : tuple of str
        Nets that clock something, by name.
    """

    netlist: Netlist
    order: list[int] = field(default_factory=list)
    incoming: list[list[Edge]] = field(default_factory=list)
    starts: list[list[Start]] = field(default_factory=list)
    endpoints: list[Endpoint] = field(default_factory=list)
    clocks: tuple[str, ...] = ()


def build_graph(netlist: Netlist, primitives: Primitives = PRIMITIVES) -> Graph:
    """Build the timing graph of ``netlist``, by default for Spartan-6.

    Raises
    ------
    UnknownCell
        A cell type without data.
    NetlistError
        A combinational loop, a latch, a falling clock edge.
    """
    return _Builder(netlist, primitives).graph


class _Builder:
    def __init__(self, netlist: Netlist, primitives: Primitives) -> None:
        self.netlist = netlist
        self.primitives = primitives
        self.graph = Graph(netlist)
        self.timings = {name: primitives.timing(cell) for name, cell in netlist.cells.items()}
        self.node_ids: dict[tuple[str, str], int] = {}
        self.node_cells: list[str] = []
        self._number_nodes()
        for name, timing in self.timings.items():
            self._add_cell(name, timing)
        self.graph.order = self._sort()
        self.graph.clocks = self._clocks()

    def _number_nodes(self) -> None:
        for name, timing in self.timings.items():
            for node in dict.fromkeys(timing.node_of.values()):
                self.node_ids[name, node] = len(self.node_cells)
                self.node_cells.append(name)
        count = len(self.node_cells)
        self.graph.incoming = [[] for _ in range(count)]
        self.graph.starts = [[] for _ in range(count)]

    def _add_cell(self, name: str, timing: CellTiming) -> None:
        graph, cell = self.graph, self.netlist.cells[name]
        for launch in timing.launches:
            if (name, launch.node) in self.node_ids:
                node = self.node_ids[name, launch.node]
                graph.starts[node].append(Start(node, name, launch.start, launch.keys))
        for arc in timing.arcs:
            if (name, arc.node) in self.node_ids:
                target = self.node_ids[name, arc.node]
                for load in _pins(cell, arc.port, arc.index):
                    self._add_edge(load, target, arc.keys)
        for setup in timing.setups:
            for load in _pins(cell, setup.port, setup.index):
                self._add_endpoint(load, setup.end, setup.keys)
        for inside in timing.insides:
            graph.endpoints.append(
                Endpoint(
                    name, inside.end, inside.keys, start=inside.start, is_period=inside.is_period
                )
            )

    def _add_edge(self, load: Pin, target: int, keys: Keys) -> None:
        connection = self._connect(load)
        if connection:
            source, bit, driver, hop, fanout = connection
            self.graph.incoming[target].append(
                Edge(source, target, bit, driver, load, hop, keys, fanout)
            )

    def _add_endpoint(self, load: Pin, register: str, keys: Keys) -> None:
        connection = self._connect(load)
        if connection:
            source, bit, driver, hop, fanout = connection
            if hop.in_slice and keys == ("ff_d",):
                keys = ("ff_d_lut",)
            self.graph.endpoints.append(
                Endpoint(load.cell, register, keys, source, bit, driver, load, hop, fanout)
            )

    def _connect(self, load: Pin) -> tuple[int, int, Pin, Hop, int] | None:
        """Follow the net into ``load`` back to a timed node; None for constants and ports."""
        bit = self._bit(load)
        if isinstance(bit, int) and self._type_of(load) in self.primitives.tables:
            bit = self._behind_inverters(bit)
        if not isinstance(bit, int) or bit not in self.netlist.drivers:
            return None
        driver = self.netlist.drivers[bit]
        node = self.timings[driver.cell].node_of.get((driver.port, driver.offset))
        if node is None:
            return None
        fanout = self._fanout(bit)
        hop = self.primitives.route(self.netlist, bit, driver, load, fanout)
        return self.node_ids[driver.cell, node], bit, driver, hop, fanout

    def _bit(self, pin: Pin) -> int | str:
        return self.netlist.cells[pin.cell].inputs[pin.port][pin.offset]

    def _behind_inverters(self, bit: int) -> int | str:
        """Return the net in front of any inverters: a LUT takes the inversion into its table."""
        visited = {bit}
        while bit in self.netlist.drivers:
            cell = self.netlist.cells[self.netlist.drivers[bit].cell]
            if cell.type != "INV":
                return bit
            before = cell.inputs["I"][0]
            if not isinstance(before, int):
                return before
            if before in visited:
                raise NetlistError(
                    f"netlist must have no combinational loop, not one at {cell.name}"
                )
            visited.add(before)
            bit = before
        return bit

    def _fanout(self, bit: int) -> int:
        """Count the pins on a net, the LUTs behind its inverters among them."""
        netlist = self.netlist
        inverted = bit in netlist.drivers and self._type_of(netlist.drivers[bit]) == "INV"
        total, pending, visited = 0, [bit], {bit}
        while pending:
            net = pending.pop()
            for pin in netlist.loads.get(net, ()):
                kind = self._type_of(pin)
                if kind == "INV":
                    after = netlist.cells[pin.cell].outputs["O"][0]
                    total += self._is_real(after)
                    if isinstance(after, int) and after not in visited:
                        visited.add(after)
                        pending.append(after)
                elif kind in self.primitives.tables:
                    total += not inverted  # behind an inverter: counted at the net before it
                else:
                    total += net == bit
        return max(1, total + (bit in netlist.output_bits_set))

    def _is_real(self, after: int | str) -> bool:
        """True if an inverter's output reaches anything but LUTs, so that it stays a cell."""
        if not isinstance(after, int):
            return False
        loads = self.netlist.loads.get(after, ())
        return after in self.netlist.output_bits_set or any(
            self._type_of(pin) not in self.primitives.tables | {"INV"} for pin in loads
        )

    def _type_of(self, pin: Pin) -> str:
        return self.netlist.cells[pin.cell].type

    def _sort(self) -> list[int]:
        """Order the nodes by Kahn's method."""
        incoming = self.graph.incoming
        waiting = [len(edges) for edges in incoming]
        outgoing: list[list[int]] = [[] for _ in incoming]
        for target, edges in enumerate(incoming):
            for edge in edges:
                outgoing[edge.source].append(target)
        ready = deque(node for node, n in enumerate(waiting) if n == 0)
        order = []
        while ready:
            node = ready.popleft()
            order.append(node)
            for target in outgoing[node]:
                waiting[target] -= 1
                if waiting[target] == 0:
                    ready.append(target)
        if len(order) < len(incoming):
            raise NetlistError(
                "netlist must have no combinational loop, not one through "
                + " -> ".join(self._find_loop(waiting))
            )
        return order

    def _find_loop(self, waiting: list[int]) -> list[str]:
        """Walk backwards through nodes left unordered until one repeats."""
        node = next(i for i, n in enumerate(waiting) if n)
        positions: dict[int, int] = {}
        walk: list[int] = []
        while node not in positions:
            positions[node] = len(walk)
            walk.append(node)
            node = next(e.source for e in self.graph.incoming[node] if waiting[e.source])
        loop = [self.node_cells[n] for n in reversed(walk[positions[node] :])]
        return [*loop, loop[0]]

    def _clocks(self) -> tuple[str, ...]:
        bits = {
            bit
            for cell in self.netlist.cells.values()
            for port in self.primitives.clocks(cell) & cell.inputs.keys()
            for bit in cell.inputs[port]
            if isinstance(bit, int)
        }
        return tuple(sorted(self.netlist.name_of(bit) for bit in bits))


def _pins(cell: Cell, port: str, index: int | None) -> list[Pin]:
    """Return the pins of ``port`` that carry a net."""
    bits = cell.inputs.get(port, ())
    wanted = range(len(bits)) if index is None else [i for i in (index,) if i < len(bits)]
    return [Pin(cell.name, port, i) for i in wanted if isinstance(bits[i], int)]
