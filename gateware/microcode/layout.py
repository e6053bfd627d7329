"""The microword of a machine as a layout."""

from __future__ import annotations

from amaranth.lib import data

from boresight.gateware.machine import Field, Machine


def microword_layout(machine: Machine) -> data.StructLayout:
    """Layout of one microword: the fields of ``machine.fields``, least significant first."""
    return data.StructLayout({f.name: f.width for f in machine.fields})


def lane_fields(machine: Machine) -> dict[str, Field]:
    """Fields of one lane by their names without the lane's number."""
    return {f.name[:-1]: f for f in machine.fields if f.name.endswith("0")}
