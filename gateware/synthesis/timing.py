"""Static timing of a netlist: the longest register-to-register path, and the highest clock.

This is an **estimate, not ISE; sign-off needs trce**. Nets are not placed: each costs the median
or upper quartile of nets of its fanout. Paths from and to the module's own ports are not counted,
all registers are taken to share one clock, and no path is recognised as false or multi-cycle.
"""

import math
from collections import Counter
from dataclasses import dataclass, replace
from itertools import accumulate

from boresight.gateware.synthesis.graph import Edge, Endpoint, Graph, Start, build_graph
from boresight.gateware.synthesis.netlist import Netlist, Pin
from boresight.gateware.synthesis.spartan6.delays import Delay, DelayTable, delay_table

#: Note in every report of these figures.
NOTE = "estimate, not ISE; sign-off needs trce"


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """One step of a path.

    Attributes
    ----------
    cell, type : str
        Instance and primitive; an empty cell for clock uncertainty.
    entry, exit : str
        Pins through which the path comes and leaves, with bit index.
    net : str
        Name of the net that leads here, empty at a start.
    fanout : int
        Pins on that net.
    net_ns, cell_ns : float
        Delay of the net, then of the cell.
    total_ns : float
        Sum from the start up to here.
    src : str
        Source location of the cell, where yosys kept it.
    keys : tuple of str
        Names of the delays in this step.
    """

    cell: str
    type: str
    entry: str
    exit: str
    net: str = ""
    fanout: int = 0
    net_ns: float = 0.0
    cell_ns: float = 0.0
    total_ns: float = 0.0
    src: str = ""
    keys: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class TimingPath:
    """A path from register to register.

    Attributes
    ----------
    start, end : str
        ``name.register`` of both ends, the name a net's where the cell has none.
    group : str
        Kind of end, e.g. ``FDRE.D``.
    delay_ns : float
        Clock-to-output, logic, nets, setup and clock uncertainty; inside one cell, as
        the cell's own limit states it, without uncertainty.
    slack_ns : float
        Requested period minus ``delay_ns``.
    points : tuple of PathPoint
        The steps; empty for paths that were not traced.
    """

    start: str
    end: str
    group: str
    delay_ns: float
    slack_ns: float
    points: tuple[PathPoint, ...] = ()

    @property
    def logic_ns(self) -> float:
        """Time spent in cells, clock uncertainty included."""
        return round(math.fsum(p.cell_ns for p in self.points), 3)

    @property
    def net_ns(self) -> float:
        """Time spent in nets."""
        return round(math.fsum(p.net_ns for p in self.points), 3)


@dataclass(frozen=True, kw_only=True)
class Group:
    """The paths that end at one kind of pin: how many, the longest, and a histogram by 1 ns."""

    name: str
    count: int
    worst_ns: float
    histogram: dict[int, int]


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Timing of a netlist at one corner. An estimate: see :data:`NOTE`.

    Attributes
    ----------
    grade : int
        Speed grade.
    nets : str
        Net model.
    period_ns : float
        Clock period that slacks refer to.
    worst : TimingPath or None
        The longest path, traced; None if no register feeds a register.
    ends : tuple of TimingPath
        The longest path to each of the worst endpoints, longest first, not traced.
    groups : tuple of Group
        By kind of endpoint, worst first.
    guessed : dict
        Delays on the longest path that are guesses, by name.
    clocks : tuple of str
        Names of the clock nets.
    """

    grade: int
    nets: str
    period_ns: float
    worst: TimingPath | None
    ends: tuple[TimingPath, ...]
    groups: tuple[Group, ...]
    guessed: dict[str, Delay]
    clocks: tuple[str, ...]

    @property
    def fmax_mhz(self) -> float | None:
        """Highest clock in MHz, rounded down to 0.1; None if nothing limits it."""
        if self.worst is None:
            return None
        return int(10_000.0 / self.worst.delay_ns) / 10

    @property
    def source(self) -> str:
        """Return a line about the kind of figures."""
        number = len(self.guessed)
        guesses = f"{number} guessed constant{'' if number == 1 else 's'} on the worst path"
        return f"static timing, grade -{self.grade}, {self.nets} nets: {NOTE}, {guesses}"


def analyse(
    netlist: Netlist | Graph,
    *,
    grade: int = 2,
    nets: str = "median",
    clock_mhz: float | None = None,
    top: int = 10,
    table: DelayTable | None = None,
) -> Timing:
    """Estimate the timing of ``netlist``.

    Parameters
    ----------
    netlist : Netlist or Graph
        A netlist, or its graph if several corners are wanted.
    grade : int
        Speed grade, 2 or 3.
    nets : str
        Net model, ``median`` or ``p75``.
    clock_mhz : float, optional
        Clock that slacks refer to, > 0; None: the highest one.
    top : int
        Number of endpoints to list, >= 1.
    table : DelayTable, optional
        Delays to use in place of those of ``grade`` and ``nets``.
    """
    if clock_mhz is not None and not clock_mhz > 0:
        raise ValueError(f"clock_mhz must be above 0, not {clock_mhz!r}")
    if top < 1:
        raise ValueError(f"top must be at least 1, not {top!r}")
    graph = netlist if isinstance(netlist, Graph) else build_graph(netlist)
    delays = table if table is not None else delay_table(grade=grade, nets=nets)
    return _Analysis(graph, delays).timing(clock_mhz=clock_mhz, top=top)


class _Analysis:
    """Arrival times of one graph under one table of delays."""

    def __init__(self, graph: Graph, delays: DelayTable) -> None:
        self.graph = graph
        self.delays = delays
        self.arrival: list[float | None] = [None] * len(graph.incoming)
        self.reason: list[Edge | Start | None] = [None] * len(graph.incoming)
        for node in graph.order:
            self._propagate(node)

    def _ns(self, keys: tuple[str, ...]) -> float:
        return self.delays.total(keys)

    def _net_ns(self, net: str) -> float:
        return self.delays[net].ns if net else 0.0

    def _propagate(self, node: int) -> None:
        best: float | None = None
        for start in self.graph.starts[node]:
            time = self._ns(start.keys)
            if best is None or time > best:
                best, self.reason[node] = time, start
        for edge in self.graph.incoming[node]:
            before = self.arrival[edge.source]
            if before is None:
                continue
            time = before + self._net_ns(edge.hop.net) + self._ns(edge.hop.entry + edge.keys)
            if best is None or time > best:
                best, self.reason[node] = time, edge
        self.arrival[node] = best

    def _delay(self, end: Endpoint) -> float | None:
        """Return the longest delay to ``end``, or None if no register leads there."""
        if end.hop is None:
            return self._ns(end.keys)  # one clock pin at both ends: no skew
        before = self.arrival[end.source]
        if before is None:
            return None
        time = before + self._net_ns(end.hop.net) + self._ns(end.hop.entry + end.keys)
        return time + self.delays["clock_uncertainty"].ns

    def timing(self, *, clock_mhz: float | None, top: int) -> Timing:
        delays = [(d, e) for e in self.graph.endpoints if (d := self._delay(e)) is not None]
        delays.sort(key=lambda item: (-item[0], item[1].cell, item[1].register))
        longest = delays[0][0] if delays else 0.0
        period = longest if clock_mhz is None else 1000.0 / clock_mhz
        worst = self._path(*delays[0], period, traced=True) if delays else None
        keys = [k for p in worst.points for k in p.keys] if worst else []
        return Timing(
            grade=self.delays.grade,
            nets=self.delays.nets,
            period_ns=round(period, 3),
            worst=worst,
            ends=tuple(self._path(d, e, period, traced=False) for d, e in delays[:top]),
            groups=self._groups(delays),
            guessed={k: self.delays[k] for k in dict.fromkeys(keys) if self.delays[k].guessed},
            clocks=self.graph.clocks,
        )

    def _group_of(self, end: Endpoint) -> str:
        kind = self.graph.netlist.cells[end.cell].type
        if end.load is not None:
            return f"{kind}.{end.load.port}"
        return f"{kind} period" if end.is_period else f"{kind} inside"

    def _groups(self, delays: list[tuple[float, Endpoint]]) -> tuple[Group, ...]:
        members: dict[str, list[float]] = {}
        for delay, end in delays:
            members.setdefault(self._group_of(end), []).append(delay)
        return tuple(
            Group(
                name=name,
                count=len(times),
                worst_ns=round(max(times), 3),
                histogram=dict(sorted(Counter(int(t) for t in times).items())),
            )
            for name, times in members.items()
        )

    def _path(self, delay: float, end: Endpoint, period: float, *, traced: bool) -> TimingPath:
        start, edges = self._trace(end)
        cell, register = (end.cell, end.start) if start is None else (start.cell, start.register)
        return TimingPath(
            start=_label(self.graph.netlist, cell, register),
            end=_label(self.graph.netlist, end.cell, end.register),
            group=self._group_of(end),
            delay_ns=round(delay, 3),
            slack_ns=round(period - delay, 3),
            points=self._points(start, edges, end) if traced else (),
        )

    def _trace(self, end: Endpoint) -> tuple[Start | None, list[Edge]]:
        """Walk back from ``end`` to the register that starts its longest path."""
        edges: list[Edge] = []
        if end.hop is None:
            return None, edges
        reason = self.reason[end.source]
        while isinstance(reason, Edge):
            edges.append(reason)
            reason = self.reason[reason.source]
        return reason, edges[::-1]

    def _points(
        self, start: Start | None, edges: list[Edge], end: Endpoint
    ) -> tuple[PathPoint, ...]:
        leaving = [_text(e.driver) for e in edges] + ([_text(end.driver)] if end.driver else [])
        steps: list[tuple[PathPoint, float]] = []
        if start is not None:
            first = self._point(start.cell, start.keys, entry=start.register, leave=leaving[0])
            steps.append(first)
        for edge, leave in zip(edges, leaving[1:], strict=True):
            steps.append(self._arrival(edge, edge.load, leave))
        if end.hop is not None and end.load is not None:
            steps.append(self._arrival(end, end.load, end.register))
        else:
            steps.append(self._point(end.cell, end.keys, entry=end.start, leave=end.register))
        if end.hop is not None:
            steps.append(self._point("", ("clock_uncertainty",)))
        totals = accumulate(ns for _, ns in steps)
        return tuple(
            replace(point, total_ns=round(total, 3))
            for (point, _), total in zip(steps, totals, strict=True)
        )

    def _arrival(self, step: Edge | Endpoint, load: Pin, leave: str) -> tuple[PathPoint, float]:
        """The net to ``load`` and its cell; see `_point`."""
        assert step.hop is not None
        point, ns = self._point(
            load.cell, step.hop.entry + step.keys, entry=_text(load), leave=leave
        )
        net, net_ns = step.hop.net, self._net_ns(step.hop.net)
        arrival = replace(
            point,
            net=self.graph.netlist.name_of(step.bit),
            fanout=step.fanout,
            net_ns=round(net_ns, 3),
            keys=(net, *point.keys) if net else point.keys,
        )
        return arrival, net_ns + ns

    def _point(
        self, cell: str, keys: tuple[str, ...], *, entry: str = "", leave: str = ""
    ) -> tuple[PathPoint, float]:
        """A cell on a path, and its delay [ns]."""
        netlist_cell, ns = self.graph.netlist.cells.get(cell), self._ns(keys)
        kind, src = (netlist_cell.type, netlist_cell.src) if netlist_cell else ("clock", "")
        point = PathPoint(
            cell=cell, type=kind, entry=entry, exit=leave, cell_ns=round(ns, 3), src=src, keys=keys
        )
        return point, ns


def _text(pin: Pin) -> str:
    """Write a pin as ``port[index]``."""
    return f"{pin.port}[{pin.offset}]"


def _label(netlist: Netlist, cell: str, register: str) -> str:
    """Name a register: by its instance, or by its output net where yosys made the instance up."""
    if cell.startswith("$"):
        bits = [b for port in netlist.cells[cell].outputs.values() for b in port]
        nets = [netlist.names[b] for b in bits if isinstance(b, int) and b in netlist.names]
        written = [name for name in nets if not name.startswith("$")]
        if written:
            return f"{written[0]}.{register}"
    return f"{cell}.{register}"
