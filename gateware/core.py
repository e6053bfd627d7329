"""From programs to a core: schedule, allocate, assemble, prove, Verilog."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from typing import Any

from boresight.gateware.machine import Machine, machine_named
from boresight.gateware.microcode.image import Image, assemble
from boresight.gateware.microcode.validation import validate_microcode
from boresight.gateware.schedule.allocate import Allocation, allocate_together
from boresight.gateware.schedule.list_pass import ListProblem, Variant, list_pass
from boresight.gateware.schedule.slots import Schedule, ScheduleError, paths, with_copies
from boresight.gateware.synthesis.tools import kept_verilog
from boresight.model.words.program import Kind, Program


def machine_for(config: str, program: Program) -> Machine:
    """The machine called ``config`` with the program's word width; raises as `machine_named`."""
    return dataclasses.replace(machine_named(config), arithmetic=program.arithmetic)


@dataclass(frozen=True)
class Part:
    """A program in a core, with schedule and registers."""

    program: Program
    schedule: Schedule
    allocation: Allocation


@dataclass(frozen=True)
class Core:
    """Compiled programs on a machine; one of them is selected.

    `program`, `schedule`, `allocation` and `parameter_addresses` are those of the
    selected program; `select` changes it. The microcode is proven to compute the programs
    (`gateware.microcode.validation`).
    """

    #: The programs, by their numbers in the core.
    parts: tuple[Part, ...]
    machine: Machine
    image: Image
    #: The selected program. The hardware always begins with program 0.
    number: int = 0
    #: Verilog by file name that stands for the generated one: ``core.v``, and the primitives in it;
    #: empty: it is generated.
    files: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    #: Generated Verilog, by form; it does not depend on the selected program.
    _texts: dict[tuple[bool, bool], str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def program(self) -> Program:
        return self.parts[self.number].program

    @property
    def schedule(self) -> Schedule:
        """The program laid out in time."""
        return self.parts[self.number].schedule

    @property
    def allocation(self) -> Allocation:
        return self.parts[self.number].allocation

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.program.name for part in self.parts)

    @property
    def name(self) -> str:
        """Name of the only program, else "core"."""
        return "core" if len(self.parts) > 1 else self.program.name

    @property
    def digest(self) -> str:
        """Hexadecimal identifier of all programs in their order; of a single one, its own."""
        return _digest([part.program for part in self.parts])

    @property
    def identity(self) -> str:
        """Short hexadecimal identifier of the programs, their schedules, and the machine."""
        return hashlib.sha256(repr((self.machine, self.image)).encode()).hexdigest()[:12]

    def select(self, number: int) -> Core:
        """Return the same core with another program selected."""
        return dataclasses.replace(self, number=number)

    def verilog(self, *, instances: bool, identified: bool | None = None) -> str:
        """Verilog of module ``core``: with vendor primitives, or with their behaviour.

        ``instances``: with LUT6 and DSP48A1, for synthesis to Spartan-6. ``identified``: with the
        build identifier; by default as ``instances``. Without it the Verilog of all programs of a
        machine differs only in memory contents, which simulations exploit.
        """
        if self.files:
            return self.files["core.v"]
        form = instances, instances if identified is None else identified
        if form not in self._texts:
            image = self.image if form[1] else dataclasses.replace(self.image, digest=0)

            def make() -> Any:
                from boresight.gateware.engine.engine import Engine  # Amaranth, a fifth of a second

                return Engine(machine=self.machine, image=image)

            identity = self.machine, image
            self._texts[form] = kept_verilog(make, "core", identity, instances=instances)
        return self._texts[form]

    @property
    def parameter_addresses(self) -> dict[str, int]:
        """Bus address of every parameter of the program."""
        where = self.allocation.addresses
        return {
            self.program.values[n].name: self.machine.parameter_address(where[n])
            for n in self.program.of_kind(Kind.PARAM)
        }


def build_core(program: Program, config: str) -> Core:
    """Compile a program for a configuration; see `build_shared_core`."""
    return build_shared_core([program], config)


def build_shared_core(programs: Sequence[Program], config: str) -> Core:
    """Compile programs into one core for a configuration.

    The programs have the same arithmetic and the same function tables. Raises InputError for an
    unknown configuration, ScheduleError if the programs do not fit the machine, Refuted if the
    microcode does not compute them: a bug of the compiler.
    """
    if len({p.name for p in programs}) < len(programs):
        raise ValueError(f"programs must have different names, not {[p.name for p in programs]}")
    machine = machine_for(config, programs[0])
    quotas = state_quotas(programs, machine)
    plans = [
        schedule(program, machine, state_quota=quota, digest=program.digest)
        for program, quota in zip(programs, quotas, strict=True)
    ]
    allocations = allocate_together(plans)
    images = [*map(assemble, plans, allocations)]
    try:
        image = Image.join(images, digest=int(_digest(programs), 16))
    except ValueError as error:
        raise ScheduleError(f"{', '.join(p.name for p in programs)}: {error}") from None
    if len(image.rom) > machine.rom_words:
        each = ", ".join(f"{p.name} {len(x.rom)}" for p, x in zip(programs, images, strict=True))
        raise ScheduleError(
            f"the programs take {len(image.rom)} microwords, the {machine.name} machine has "
            f"{machine.rom_words}: {each}"
        )
    image.check(machine)
    validate_microcode(machine, image, programs, [a.addresses for a in allocations])
    return Core(tuple(map(Part, programs, plans, allocations)), machine, image)


#: The variants of list scheduling; the best of their schedules is taken.
VARIANTS = tuple(
    Variant(reuse, delay_gets=delay_gets, whole_group=whole_group)
    for reuse, delay_gets, whole_group in product((4, 16, 32), (True, False), (True, False))
)


@lru_cache(maxsize=256)
def schedule(
    program: Program,
    machine: Machine,
    *,
    state_quota: tuple[int, ...] | None = None,
    digest: str = "",
) -> Schedule:
    """Schedule a program on a machine with its arithmetic; ScheduleError if it does not fit.

    List scheduling (`gateware.schedule.list_pass`) with priorities from longest paths. The best
    schedule has the smallest latency of the last urgent output, then is the shortest, then has the
    fewest slots. ``state_quota`` is the most next states of each lane, by default what its bank
    holds. ``digest`` distinguishes programs with 0.0 and -0.0 in the cache of this function.
    """
    urgent = len(program.outputs) if program.urgent is None else program.urgent
    lowered = with_copies(program)
    far = paths(lowered, machine, urgent)
    problem = ListProblem(lowered, machine, far=far, urgent=urgent, state_quota=state_quota)
    words = -(-sum(far.slots) // machine.lanes)
    if words > machine.rom_words:
        raise ScheduleError(
            f"{program.name}: program takes {words} microwords or more, the "
            f"{machine.name} machine has {machine.rom_words}; compute less in an update"
        )
    best = min((list_pass(problem, variant) for variant in VARIANTS), key=lambda x: x.score)
    return Schedule(
        program=lowered,
        source=program.digest,
        machine=machine,
        slots=problem.slots(best),
        gets=best.gets,
        length=best.length,
        urgent=urgent,
    )


def _digest(programs: Sequence[Program]) -> str:
    if len(programs) == 1:
        return programs[0].digest
    text = " ".join(p.digest for p in programs)
    return hashlib.sha256(text.encode()).hexdigest()[: len(programs[0].digest)]


def state_quotas(programs: Sequence[Program], machine: Machine) -> list[tuple[int, ...]]:
    """For each program, the maximum number of states in each bank; ScheduleError if they are more.

    Each program gets an even share of the lanes for its states, and a part of the remaining
    registers in proportion to its number of states.
    """
    lanes, slots = machine.lanes, machine.state_slots
    counts = [len(p.states) for p in programs]
    total, room = sum(counts), lanes * slots
    if total > room:
        counted = [f"{p.name} {n}" for p, n in zip(programs, counts, strict=True)]
        raise ScheduleError(
            f"{', '.join(counted) if len(counted) > 1 else programs[0].name}: {total} states, the "
            f"{machine.name} machine has room for {room}{machine.remedy(total, room)}"
        )
    spare = slots - -(-total // lanes)
    quotas, first = [], 0
    for count in counts:
        # The k-th state of all is in lane k modulo lanes.
        shares = [len(range((lane - first) % lanes, count, lanes)) for lane in range(lanes)]
        quotas.append(tuple(n + (spare * count // total if total else 0) for n in shares))
        first += count
    return quotas
