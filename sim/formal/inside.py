"""The registers inside of a component, for assertions that induction needs.

Induction begins in any state whatsoever, so a harness has to say which states there are: it must
name registers that the component does not show. They are found by the names of the variables that
``elaborate`` keeps them in, with no change to the component.
"""

from __future__ import annotations

import sys
from types import FrameType
from typing import Any

from amaranth.hdl import Elaboratable, Module, Signal, Value
from amaranth.lib import memory

__all__ = ["Inside"]


class Inside:
    """A component, elaborated so that its registers can be named.

    Use ``inside.module`` as the submodule instead of the component; the component's ports are
    connected as ever.

    Parameters
    ----------
    component : Elaboratable
        The component, not yet elaborated.
    platform : Any
        Platform of the harness.

    Attributes
    ----------
    module : Module
        What to add to the harness.
    parts : dict of str to Inside
        Its submodules that are components.
    memories : dict of str to Memory
        Its memories: a harness may add a read port of domain ``comb``.
    """

    def __init__(self, component: Elaboratable, platform: Any) -> None:
        component._MustUse__used = True  # as Amaranth does when it elaborates
        self.name = type(component).__name__
        self.module, self._variables = _watched(component, platform)
        self.parts: dict[str, Inside] = {}
        self.memories: dict[str, memory.Memory] = {}
        inner = self.module._named_submodules
        for name, (part, place) in list(inner.items()):
            if isinstance(part, memory.Memory):
                self.memories[name] = part
            elif isinstance(part, Elaboratable) and not isinstance(part, Module):
                opened = _opened(part, platform)
                if opened is not None:
                    self.parts[name] = opened
                    inner[name] = (opened.module, place)

    def __getitem__(self, name: str) -> Signal:
        """The signal of that name; ``part.name`` for one of a part.

        Raises
        ------
        KeyError
            None has this name.
        """
        part, dot, rest = name.partition(".")
        if dot:
            if part not in self.parts:
                raise KeyError(
                    f"{self.name} must have a part {part}, not only "
                    f"{', '.join(self.parts) or 'no part'}"
                )
            return self.parts[part][rest]
        if not isinstance(self._variables.get(name), Signal):
            raise KeyError(f"{self.name}.elaborate must have a signal {name}")
        return self._variables[name]

    def variable(self, name: str) -> Any:
        """What the variable ``name`` of ``elaborate`` held in the end: a list of signals, say."""
        return self._variables[name]

    def state(self, *names: str, fsm: str = "fsm") -> Value:
        """1 while the state machine ``fsm`` is in one of these states."""
        machine = self.module._generated[fsm]
        is_in: Value = Value.cast(0)
        for name in names:
            is_in = is_in | (machine.state == machine.encoding[name])
        return is_in

    def legal(self, *, fsm: str = "fsm") -> Value:
        """1 while the state machine ``fsm`` is in any of its states."""
        machine = self.module._generated[fsm]
        return machine.state < len(machine.encoding)


def _watched(component: Elaboratable, platform: Any) -> tuple[Module, dict[str, Any]]:
    """The module, and the variables of ``elaborate`` when it returned."""
    code = component.elaborate.__func__.__code__
    variables: dict[str, Any] = {}

    def watch(frame: FrameType, event: str, _: Any) -> None:
        if event == "return" and frame.f_code is code:
            variables.update(frame.f_locals)

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        module = component.elaborate(platform)
    finally:
        sys.setprofile(before)
    return module, variables


def _opened(part: Elaboratable, platform: Any) -> Inside | None:
    """The part, if it is made with a Module; others stay closed and are elaborated later."""
    if type(part).__module__.startswith("amaranth."):
        return None
    return Inside(part, platform)
