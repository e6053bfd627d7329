"""The DSP48A1 slice of Spartan-6: multiplier, post-adder, and its optional registers."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import ClockSignal, Const, Elaboratable, Instance, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Z(IntEnum):
    """Second operand of the post-adder, OPMODE[3:2]."""

    ZERO = 0
    PCIN = 1
    C = 3


def is_spartan6(platform: Any) -> bool:
    """Whether ``platform`` builds for a Spartan-6, by its ``device`` attribute."""
    return str(getattr(platform, "device", "")).lower().startswith("xc6s")


class DSP48A1(wiring.Component):
    """One DSP48A1 slice with a constant operation and one clock enable.

    The part of the slice that Boresight uses: no pre-adder, no carry in, no resets. For a platform
    with such slices (`is_spartan6`) this is the vendor's primitive, otherwise a behavioural
    description of it; both are proved equal in the tests.

    ::

        M = A * B        P = Z + M   or   Z

    **Latency** Each parameter that is true adds one register: A and B pass ``reg0 + reg1`` of them,
    the product ``mreg`` and the sum ``preg``.

    Parameters
    ----------
    adds : bool
        Whether the sum has the product.
    z : Z
        Second operand of the post-adder. ``Z.PCIN`` demands that ``pcin`` be the ``pcout`` of
        another slice.
    """

    def __init__(
        self,
        *,
        reg0: bool = False,
        reg1: bool = False,
        mreg: bool = False,
        preg: bool = False,
        adds: bool = True,
        z: Z = Z.ZERO,
    ) -> None:
        self.registers = {"a0reg": reg0, "a1reg": reg1, "b0reg": reg0, "b1reg": reg1}
        self.registers |= {"creg": False, "mreg": mreg, "preg": preg}
        self.adds = adds
        self.z = z
        super().__init__(
            {
                "en": In(1),  # Clock enable of every register.
                # Factors.
                "a": In(signed(18)),
                "b": In(signed(18)),
                "c": In(signed(48)),  # Addend.
                "pcin": In(signed(48)),  # Addend from the cascade.
                "m": Out(signed(36)),  # Product, after ``mreg``.
                # Sum, after ``preg``; to the fabric and to the cascade.
                "p": Out(signed(48)),
                "pcout": Out(signed(48)),
            }
        )

    @property
    def opmode(self) -> int:
        """The constant on OPMODE."""
        return self.z << 2 | self.adds

    def elaborate(self, platform: Any) -> Elaboratable:
        """Primitive or behaviour, by the platform."""
        return self._primitive() if is_spartan6(platform) else self._behaviour()

    def _primitive(self) -> Module:
        m = Module()
        registers = {f"p_{name.upper()}": int(used) for name, used in self.registers.items()}
        enables = {f"i_CE{name}": self.en for name in ("A", "B", "C", "M", "P")}
        idle = ("CED", "CECARRYIN", "CEOPMODE", "CARRYIN")
        resets = (f"RST{name}" for name in ("A", "B", "C", "D", "M", "P", "CARRYIN", "OPMODE"))
        unused = {f"i_{name}": Const(0) for name in (*idle, *resets)}
        m.submodules.slice = Instance(
            "DSP48A1",
            **registers,
            p_DREG=0,
            p_OPMODEREG=0,
            p_CARRYINREG=0,
            p_CARRYOUTREG=0,
            p_CARRYINSEL="OPMODE5",
            p_RSTTYPE="SYNC",
            i_CLK=ClockSignal(),
            **enables,
            **unused,
            i_D=Const(0, 18),
            i_OPMODE=Const(self.opmode, 8),
            i_A=self.a,
            i_B=self.b,
            i_C=self.c,
            i_PCIN=self.pcin,
            o_M=self.m,
            o_P=self.p,
            o_PCOUT=self.pcout,
        )
        return m

    def _behaviour(self) -> Module:
        m = Module()

        def register(value: Value, used: bool, name: str) -> Value:
            if not used:
                return value
            out = Signal.like(value, name=name, reset_less=True)
            with m.If(self.en):
                m.d.sync += out.eq(value)
            return out

        use = self.registers
        a = register(register(self.a, use["a0reg"], "a0"), use["a1reg"], "a1")
        b = register(register(self.b, use["b0reg"], "b0"), use["b1reg"], "b1")
        product = Signal.like(self.m)
        m.d.comb += [product.eq(a * b), self.m.eq(register(product, use["mreg"], "m0"))]
        z = {Z.ZERO: 0, Z.PCIN: self.pcin, Z.C: self.c}[self.z]
        total = Signal.like(self.p)
        m.d.comb += [
            total.eq(z + (self.m if self.adds else 0)),
            self.p.eq(register(total, use["preg"], "p0")),
            self.pcout.eq(self.p),
        ]
        return m
