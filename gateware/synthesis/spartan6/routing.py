"""Connections of output and input pins: a routed net, or a wire inside the slice.

Slice geometry decides: a carry chain's S input and an F7 multiplexer's data inputs are fed by the
LUT of the same position only, so a LUT there costs no routing, and any other driver passes through
one.
"""

from boresight.gateware.synthesis.arcs import Hop
from boresight.gateware.synthesis.netlist import Netlist, Pin
from boresight.gateware.synthesis.spartan6.celltypes import FLIP_FLOPS, LUTS
from boresight.gateware.synthesis.spartan6.delays import fanout_key

_MUXES = frozenset({"MUXF7", "MUXF8"})
#: Dedicated wires of the DSP column: output port -> input port of the next slice.
_DSP_CASCADES = {"PCOUT": "PCIN", "BCOUT": "B", "CARRYOUT": "CARRYIN"}


def route(netlist: Netlist, bit: int, driver: Pin, load: Pin, fanout: int) -> Hop:
    """Return the path of the net ``bit`` from ``driver`` to ``load``.

    Parameters
    ----------
    fanout : int
        Pins on the net, including those after absorbed inverters.
    """
    source = netlist.cells[driver.cell].type
    target = netlist.cells[load.cell].type
    routed = fanout_key(fanout)
    is_lut = source in LUTS or source == "INV"
    if source == "CARRY4" and driver.port == "CO":
        if target == "CARRY4" and load.port == "CI" and driver.offset == 3:
            return Hop("net_carry")
        return Hop(routed, ("carry_exit",) if driver.offset == 3 else ())
    if target == "CARRY4" and load.port == "S":
        return Hop("") if is_lut and _is_sole_load(netlist, bit, load) else Hop(routed, ("lut",))
    if target == "MUXF7" and load.port != "S":
        return Hop("") if is_lut and _is_sole_load(netlist, bit, load) else Hop(routed, ("lut",))
    if target == "MUXF8" and load.port != "S" and source == "MUXF7":
        return Hop("")
    if source == target == "DSP48A1" and _DSP_CASCADES.get(driver.port) == load.port:
        return Hop("net_dsp")
    if target in FLIP_FLOPS and load.port == "D" and fanout == 1:
        if is_lut or source in _MUXES:
            return Hop("", in_slice=True)
        if source == "CARRY4" and driver.port == "O":
            return Hop("")
    return Hop(routed)


def _is_sole_load(netlist: Netlist, bit: int, load: Pin) -> bool:
    """True if no other input of the same kind needs the same LUT."""
    kind = netlist.cells[load.cell].type
    rivals = [
        pin
        for pin in netlist.loads[bit]
        if netlist.cells[pin.cell].type == kind and (pin.port == "S") == (load.port == "S")
    ]
    return len(rivals) == 1
