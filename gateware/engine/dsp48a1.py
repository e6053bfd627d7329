"""The DSP48A1 slice of Spartan-6: multiplier, post-adder, and its optional registers."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import ClockSignal, Const, Elaboratable, Instance, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class X(IntEnum):
    """First operand of the post-adder, OPMODE[1:0]."""

    ZERO = 0
    M = 1
    P = 2


class Z(IntEnum):
    """Second operand of the post-adder, OPMODE[3:2]."""

    ZERO = 0
    PCIN = 1
    P = 2
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

        M = A * B        P = Z + X   or   Z - X  (subtract)

    **Latency** Each parameter that is true adds one register: A and B pass ``a0reg + a1reg`` and
    ``b0reg + b1reg`` of them, C passes ``creg``, the product ``mreg`` and the sum ``preg``.

    Parameters
    ----------
    a0reg, a1reg, b0reg, b1reg, creg, mreg, preg : bool
        Registers in use.
    x : X
        First operand of the post-adder.
    z : Z
        Second operand of the post-adder. ``Z.PCIN`` demands that ``pcin`` be the ``pcout`` of
        another slice.
    subtract : bool
        Subtract X from Z.

    Members
    -------
    en : In(1)
        Clock enable of every register.
    a, b : In(signed(18))
        Factors.
    c : In(signed(48))
        Addend.
    pcin : In(signed(48))
        Addend from the cascade.
    m : Out(signed(36))
        Product, after ``mreg``.
    p, pcout : Out(signed(48))
        Sum, after ``preg``; to the fabric and to the cascade.
    """

    def __init__(
        self,
        *,
        a0reg: bool = False,
        a1reg: bool = False,
        b0reg: bool = False,
        b1reg: bool = False,
        creg: bool = False,
        mreg: bool = False,
        preg: bool = False,
        x: X = X.M,
        z: Z = Z.ZERO,
        subtract: bool = False,
    ) -> None:
        self.registers = {
            "a0reg": a0reg,
            "a1reg": a1reg,
            "b0reg": b0reg,
            "b1reg": b1reg,
            "creg": creg,
            "mreg": mreg,
            "preg": preg,
        }
        for name, value in {**self.registers, "subtract": subtract}.items():
            if not isinstance(value, bool):
                raise TypeError(f"{name} must be a bool, not {value!r}")
        if not isinstance(x, X):
            raise TypeError(f"x must be an X, not {x!r}")
        if not isinstance(z, Z):
            raise TypeError(f"z must be a Z, not {z!r}")
        if not preg and (x is X.P or z is Z.P):
            raise ValueError("preg must be True when the post-adder reads P, not False")
        self.x = x
        self.z = z
        self.subtract = subtract
        super().__init__(
            {
                "en": In(1),
                "a": In(signed(18)),
                "b": In(signed(18)),
                "c": In(signed(48)),
                "pcin": In(signed(48)),
                "m": Out(signed(36)),
                "p": Out(signed(48)),
                "pcout": Out(signed(48)),
            }
        )

    @property
    def opmode(self) -> int:
        """The constant on OPMODE."""
        return self.subtract << 7 | self.z << 2 | self.x

    def elaborate(self, platform: Any) -> Elaboratable:
        """Primitive or behaviour, by the platform."""
        return self._primitive() if is_spartan6(platform) else self._behaviour()

    def _primitive(self) -> Module:
        m = Module()
        registers = {f"p_{name.upper()}": int(used) for name, used in self.registers.items()}
        enables = {f"i_CE{name}": self.en for name in ("A", "B", "C", "M", "P")}
        unused = {
            f"i_{name}": Const(0)
            for name in (
                "CED",
                "CECARRYIN",
                "CEOPMODE",
                "CARRYIN",
                "RSTA",
                "RSTB",
                "RSTC",
                "RSTD",
                "RSTM",
                "RSTP",
                "RSTCARRYIN",
                "RSTOPMODE",
            )
        }
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
        c = register(self.c, use["creg"], "c0")
        product = Signal.like(self.m)
        m.d.comb += [product.eq(a * b), self.m.eq(register(product, use["mreg"], "m0"))]
        x = {X.ZERO: 0, X.M: self.m, X.P: self.p}[self.x]
        z = {Z.ZERO: 0, Z.PCIN: self.pcin, Z.P: self.p, Z.C: c}[self.z]
        total = Signal.like(self.p)
        m.d.comb += [
            total.eq(z - x if self.subtract else z + x),
            self.p.eq(register(total, use["preg"], "p0")),
            self.pcout.eq(self.p),
        ]
        return m
