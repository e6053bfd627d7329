"""From a program to a core: schedule, check, allocate, assemble, Verilog."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

from gateware.allocate import Allocation, allocate, parameter_addresses
from gateware.check_schedule import check_schedule
from gateware.engine import Engine
from gateware.image import Image
from gateware.listing import listing
from gateware.machine import CONFIGS, Machine
from gateware.microcode import assemble
from gateware.schedule import schedule
from gateware.slots import Schedule
from gateware.verilog import to_verilog
from model.errors import InputError
from model.program import Program

__all__ = ["Core", "build_core", "machine_for"]


def machine_for(config: str, program: Program) -> Machine:
    """The machine called ``config`` with the program's word width.

    Raises
    ------
    InputError
        No such configuration.
    """
    if config not in CONFIGS:
        raise InputError.at("config", wanted=f"one of {', '.join(CONFIGS)}", found=repr(config),
                            fix="choose one of these")
    return dataclasses.replace(CONFIGS[config], arithmetic=program.arithmetic)


@dataclass(frozen=True)
class Core:
    """A program on a machine, ready to become Verilog.

    The schedule has been proven by `gateware.check_schedule`.
    """

    program: Program
    machine: Machine
    schedule: Schedule
    allocation: Allocation
    image: Image

    def verilog(self, *, instances: bool) -> str:
        """Verilog of module ``core``: with DSP48A1 primitives, or with their behaviour.

        The latter, for simulation, has build identifier 0, so that all programs of a machine
        differ in nothing but memory contents.
        """
        image = self.image if instances else dataclasses.replace(self.image, digest=0)
        return to_verilog(Engine(machine=self.machine, image=image), "core", instances=instances)

    @cached_property
    def listing(self) -> str:
        """The microcode as text, one line per cycle."""
        return listing(self.image, self.schedule, self.allocation)

    @property
    def parameter_addresses(self) -> dict[str, int]:
        """Bus address of every parameter."""
        return parameter_addresses(self.schedule)


def build_core(program: Program, config: str, *, urgent: int | None = None,
               restarts: int = 300) -> Core:
    """Compile a program for a configuration.

    Parameters
    ----------
    urgent : int, optional
        Leading outputs whose latency counts first; all by default.
    restarts : int
        Effort of the scheduler.

    Raises
    ------
    InputError
        Unknown configuration.
    ScheduleError
        The program does not fit the machine.
    """
    machine = machine_for(config, program)
    plan = schedule(program, machine, urgent=urgent, restarts=restarts)
    allocation = allocate(plan)
    check_schedule(program, plan, allocation)
    return Core(program, machine, plan, allocation, assemble(plan, allocation))
