"""The core's netlist after synthesis as a level: the cells that the part has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

from boresight.model.arrays import FloatArray
from boresight.model.words.fixed import IntArray
from boresight.sim.levels.level import Seen
from boresight.sim.levels.rtl import Simulated
from boresight.sim.rtl.harness import CompiledSimulation
from boresight.sim.rtl.netlist import NetlistSimulation


class NetlistSimulated(Simulated):
    """The core after synthesis for the build's target, in Verilator (`sim.rtl.netlist`)."""

    name = "netlist"
    tools = ("verilator",)
    resumes = False
    usual = False  # yosys takes half a minute

    @classmethod
    def tools_of_check(cls, simulator: str | None) -> tuple[str, ...]:
        """Verilator, whatever simulates the source."""
        return cls.tools

    @cached_property
    def compiled(self) -> CompiledSimulation:
        """Simulation in Verilator."""
        return NetlistSimulation(self.core, target=self.build.target)

    def words_of_update(
        self, records: FloatArray, before: Iterable[FloatArray] = (), states: IntArray | None = None
    ) -> Sequence[Seen]:
        """Nothing: a netlist has no registers by name."""
        return ()


#: Levels of this module, for `sim.levels.registry`.
LEVELS = (NetlistSimulated,)
