"""What a harness may name of a component's inside."""

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Elaboratable, Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import Out

from boresight.gateware.serial.uart import Receiver
from boresight.sim.formal.inside import Inside


class Store(wiring.Component):
    """A register and a port of one name, two registers of another, a memory, a state machine."""

    count: Out(4)

    def elaborate(self, platform):
        m = Module()
        self.register = register = Signal(4, name="count")
        self.flags = [Signal(name="flag"), Signal(name="flag")]
        m.submodules.words = words = memory.Memory(shape=5, depth=6, init=[9])
        read = words.read_port()
        m.d.comb += [self.count.eq(register), read.addr.eq(register)]
        m.d.sync += [register.eq(register + 1), *(flag.eq(1) for flag in self.flags)]
        self._turn(m)
        return m

    def _turn(self, m):
        turn = Signal(2)
        m.d.sync += turn.eq(turn + 1)
        self.turn = turn
        with m.FSM():
            with m.State("A"):
                m.next = "B"
            with m.State("B"):
                m.next = "A"


def test_registers_by_their_names_in_the_netlist() -> None:
    inside = Inside(store := Store(), None)
    assert inside.component is store
    assert inside["count"] is store.register  # not the port
    assert inside["turn"] is store.turn  # of another method
    with pytest.raises(KeyError, match="Store must have one signal flag, not 2"):
        inside["flag"]
    with pytest.raises(KeyError, match="Store must have one signal other, not 0"):
        inside["other"]


def test_parts_memory_and_states_in_a_harness() -> None:
    class Harness(Elaboratable):
        def elaborate(self, platform):
            m = Module()
            m.submodules.dut = (inside := Inside(Store(), platform)).module
            port = inside.parts["words"].component.read_ports[0]
            seen = Signal(5)
            there = inside.word("words", inside["turn"])
            m.d.comb += seen.eq(there + port.data + inside.state("A", "B"))
            return m

    text = rtlil.convert(Harness(), name="top", ports=[])
    assert text.count("cell $memrd_v2") == 2  # the component's port and the proof's


def test_a_state_machine_has_the_states_of_its_names() -> None:
    inside = Inside(Receiver(divisor=8), None)
    with pytest.raises(KeyError, match="NOWHERE"):
        inside.state("NOWHERE")
