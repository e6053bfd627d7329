"""Timing of a DSP48A1 in any choice of its pipeline registers.

The slice is followed from its pins to its outputs as a list of *sources*: a source is either an
unregistered pin, from which a combinational arc goes on, or a register, from which a path starts.
Each register in the way turns the pins in front of it into set-ups and what follows into a new
source::

    A --[A0]--[A1]----------------+--> x --[M]--> X mux --+
    B --[B0]--+------------[B1]---+--> BCOUT              |
              +- +/- D --^                               +/- --[P]--> P, PCOUT
    D --[D]---+                                           |
    C --[C]---- PCIN --------------------------> Z mux ---+

Constant OPMODE bits determine the selections of the multiplexers, and so which of the
arcs exist: bits 1:0 select X (0, M, P, D:A:B), bits 3:2 select Z (0, PCIN, P, C), bit 4 puts the
pre-adder in front of B1. Every output bit is taken to depend on every input bit. The plain hops
A0 to A1 and B0 to B1 are far shorter than any other and are left out.
"""

from dataclasses import dataclass
from typing import NamedTuple

from boresight.gateware.synthesis.arcs import Arc, CellTiming, Inside, Keys, Launch, Setup
from boresight.gateware.synthesis.netlist import Bit, Cell, NetlistError

#: Register -> value where the instance leaves the parameter out.
_DEFAULTS = {
    "A0REG": 0,
    "A1REG": 1,
    "B0REG": 0,
    "B1REG": 1,
    "CREG": 1,
    "DREG": 1,
    "MREG": 1,
    "PREG": 1,
    "OPMODEREG": 1,
    "CARRYINREG": 1,
    "CARRYOUTREG": 1,
}
#: Letter of the enable and reset pins -> registers that they control.
_CONTROLS = {
    "A": ("A0REG", "A1REG"),
    "B": ("B0REG", "B1REG"),
    "C": ("CREG",),
    "D": ("DREG",),
    "M": ("MREG",),
    "P": ("PREG",),
    "OPMODE": ("OPMODEREG",),
    "CARRYIN": ("CARRYINREG", "CARRYOUTREG"),
}


class _Route(NamedTuple):
    """Names of the delays from one kind of source to P: by pin or register, to pin or PREG."""

    pin_p: str
    pin_preg: str
    reg_p: str
    reg_preg: str


_PRODUCT = _Route("dsp_ab_p", "dsp_ab_preg", "dsp_abreg_p", "dsp_abreg_preg")
_MREG = _Route("", "", "dsp_mreg_p", "dsp_mreg_preg")
_OPERAND = _Route("dsp_c_p", "dsp_c_preg", "dsp_creg_p", "dsp_creg_preg")
_CASCADE = _Route("dsp_pcin_p", "dsp_pcin_preg", "", "")


@dataclass(frozen=True)
class _Source:
    """A register (``port`` empty) or an unregistered pin, and delays met since then."""

    name: str
    port: str = ""
    index: int | None = None
    extra: Keys = ()


def dsp_timing(cell: Cell) -> CellTiming:
    """Return the timing of one DSP48A1."""
    return _Slice(cell).timing


class _Slice:
    """Builds the timing of one cell; attributes hold data common to the builder's steps."""

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.timing = CellTiming()
        self.has = {name: bool(cell.number(name, d)) for name, d in _DEFAULTS.items()}
        self.x = self._choices(0)
        self.z = self._choices(2)
        self.preadder = self._mode(4) != "0"
        self._outputs()
        self._controls()
        a, b = self._a(), self._b()
        self._bcout(b)
        self._post_adder(a, b)

    # reading the cell

    def _mode(self, index: int) -> Bit:
        """Return an OPMODE bit: a constant, or anything else for one that may change."""
        bits = self.cell.inputs.get("OPMODE", ())
        return bits[index] if index < len(bits) else "x"

    def _choices(self, low: int) -> set[int]:
        """Return the values that OPMODE bits ``low + 1`` and ``low`` can take."""
        bits = (self._mode(low), self._mode(low + 1))
        options = [(int(bit),) if bit in ("0", "1") else (0, 1) for bit in bits]
        return {2 * high + bit for bit in options[0] for high in options[1]}

    def _used(self, port: str) -> bool:
        return any(isinstance(bit, int) for bit in self.cell.outputs.get(port, ()))

    # steps

    def _outputs(self) -> None:
        nodes = {
            "P": "P",
            "PCOUT": "P",
            "M": "M",
            "BCOUT": "BCOUT",
            "CARRYOUT": "CARRYOUT",
            "CARRYOUTF": "CARRYOUT",
        }
        for port, node in nodes.items():
            for index in range(len(self.cell.outputs.get(port, ()))):
                self.timing.node_of[port, index] = node

    def _controls(self) -> None:
        for letter, registers in _CONTROLS.items():
            used = [name for name in registers if self.has[name]]
            if used:
                for pin in (f"CE{letter}", f"RST{letter}"):
                    self._setup(_Source("", pin), used[-1], "dsp_su_control")

    def _setup(self, source: _Source, end: str, key: str) -> None:
        keys = (*source.extra, key)
        self.timing.setups.append(Setup(source.port, source.index, end, keys))

    def _inside(self, source: _Source, end: str, key: str) -> None:
        self.timing.insides.append(Inside(source.name, end, (*source.extra, key)))

    def _register(self, source: _Source, name: str, key: str) -> _Source:
        """Put ``source`` into register ``name`` if that is in use; return the output's source."""
        if not self.has[name]:
            return source
        if source.port:
            self._setup(source, name, key)
        return _Source(name)

    def _a(self) -> list[_Source]:
        first = self._register(_Source("", "A"), "A0REG", "dsp_su_ab")
        return [self._register(first, "A1REG", "dsp_su_ab")]

    def _d(self) -> _Source:
        return self._register(_Source("", "D"), "DREG", "dsp_su_d")

    def _opmode(self, index: int) -> list[_Source]:
        """Return the source of one OPMODE bit, none if it is constant."""
        if self._mode(index) in ("0", "1"):
            return []
        pin = _Source("", "OPMODE", index)
        return [self._register(pin, "OPMODEREG", "dsp_su_mode")]

    def _b(self) -> list[_Source]:
        """Return the sources of the multiplier's B side, behind B1REG if there is one."""
        first = self._register(_Source("", "B"), "B0REG", "dsp_su_b0")
        if not self.preadder:
            return [self._register(first, "B1REG", "dsp_su_ab")]
        entering = [first, self._d(), *self._opmode(4), *self._opmode(6)]
        added = [_Source(s.name, s.port, s.index, ("dsp_preadd",)) for s in entering]
        if not self.has["B1REG"]:
            return added
        for source in added:
            if source.port:
                self._setup(source, "B1REG", "dsp_su_ab")
            else:
                self._inside(source, "B1REG", "dsp_su_ab")
        return [_Source("B1REG")]

    def _bcout(self, sources: list[_Source]) -> None:
        if self._used("BCOUT"):
            self._reach("BCOUT", sources, pin="dsp_b_bcout", reg="dsp_breg_bcout")

    def _reach(self, node: str, sources: list[_Source], *, pin: str, reg: str) -> None:
        for s in sources:
            if s.port:
                self.timing.arcs.append(Arc(s.port, s.index, node, (*s.extra, pin)))
            else:
                self.timing.launches.append(Launch(node, s.name, (*s.extra, reg)))

    def _product(self, sources: list[_Source]) -> tuple[list[_Source], _Route]:
        """Return the source of the multiplier's output, behind MREG if there is one."""
        if not self.has["MREG"]:
            if self._used("M"):
                self._reach("M", sources, pin="dsp_ab_m", reg="dsp_abreg_m")
            return sources, _PRODUCT
        for source in sources:
            if source.port:
                self._setup(source, "MREG", "dsp_ab_m")
            else:
                self._inside(source, "MREG", "dsp_abreg_mreg")
        if self._used("M"):
            self._reach("M", [_Source("MREG")], pin="", reg="dsp_mreg_m")
        return [_Source("MREG")], _MREG

    def _carry_in(self) -> list[_Source]:
        """Return the source of the post-adder's carry, behind CARRYINREG if there is one."""
        if self.cell.text("CARRYINSEL", "OPMODE5") == "OPMODE5":
            sources = self._opmode(5)
        else:
            sources = [_Source("", "CARRYIN")]
        return [self._register(s, "CARRYINREG", "dsp_su_mode") for s in sources]

    def _post_adder(self, a: list[_Source], b: list[_Source]) -> None:
        groups: list[tuple[list[_Source], _Route]] = []
        if 1 in self.x or self._used("M"):
            product = self._product([*a, *b])
            if 1 in self.x:
                groups.append(product)
        if 3 in self.x:
            groups.append(([*a, *b, self._d()], _OPERAND))
        if 1 in self.z:
            groups.append(([_Source("", "PCIN")], _CASCADE))
        if 3 in self.z:
            c = self._register(_Source("", "C"), "CREG", "dsp_su_c")
            groups.append(([c], _OPERAND))
        select = [s for index in (0, 1, 2, 3, 7) for s in self._opmode(index)]
        groups.append(([*select, *self._carry_in()], _OPERAND))
        for sources, route in groups:
            self._to_p(sources, route)
        self._feedback()
        self._drop_repeats()

    def _to_p(self, sources: list[_Source], route: _Route) -> None:
        ends = [("PREG", self.has["PREG"], "P")]
        if self._used("CARRYOUT") or self._used("CARRYOUTF"):
            ends.append(("CARRYOUTREG", self.has["CARRYOUTREG"], "CARRYOUT"))
        for end, registered, node in ends:
            if not registered:
                self._reach(node, sources, pin=route.pin_p, reg=route.reg_p)
                continue
            for source in sources:
                if source.port:
                    self._setup(source, end, route.pin_preg)
                else:
                    self._inside(source, end, route.reg_preg)
            self._reach(node, [_Source(end)], pin="", reg="dsp_preg_p")

    def _feedback(self) -> None:
        """Add the accumulator path, or refuse an accumulator without a register."""
        if self.has["PREG"]:
            if 2 in self.x or 2 in self.z:
                self._inside(_Source("PREG"), "PREG", "dsp_preg_preg")
        elif self.x == {2} or self.z == {2}:
            raise NetlistError(
                f"PREG of cell {self.cell.name} must be 1 where OPMODE feeds P back, not 0"
            )

    def _drop_repeats(self) -> None:
        """Keep each record once: a register can be reached along several steps above."""
        t = self.timing
        t.arcs = list(dict.fromkeys(t.arcs))
        t.launches = list(dict.fromkeys(t.launches))
        t.setups = list(dict.fromkeys(t.setups))
        t.insides = list(dict.fromkeys(t.insides))
