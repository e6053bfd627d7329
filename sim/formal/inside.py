"""The registers inside a component, for the assertions of induction.

Induction begins in an arbitrary state, so a harness must restrict the states, using registers that
are not ports. They are accessed by their names in the netlist, without change to the component.
"""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Fragment, MemoryInstance, Shape, Signal, Value


class Inside:
    """A component, elaborated so that its registers can be accessed by name.

    ``module`` takes the component's place as a submodule; ``parts`` are the component's submodules,
    components and memories.
    """

    def __init__(self, component: Any, platform: Any) -> None:
        self.module = Fragment.get(component, platform)
        self.component = (self.module.origins or (component,))[0]
        self.parts = {name: Inside(part, platform) for part, name, _ in self.module.subfragments}
        ports = {id(port) for inside in (self, *self.parts.values()) for port in inside._ports()}
        # Amaranth has no public function for the signals of a statement.
        self._signals = {
            id(signal): signal
            for statements in self.module.statements.values()
            for signal in (*statements._lhs_signals(), *statements._rhs_signals())
            if id(signal) not in ports
        }

    def _ports(self) -> list[Value]:
        if not hasattr(self.component, "signature"):
            return []
        ports = self.component.signature.flatten(self.component)
        return [Value.cast(port) for _, _, port in ports]

    def __getitem__(self, name: str) -> Signal:
        """The only signal with a name, other than a port."""
        matches = [signal for signal in self._signals.values() if signal.name == name]
        if len(matches) != 1:
            component = type(self.component).__name__
            raise KeyError(f"{component} must have one signal {name}, not {len(matches)}")
        return matches[0]

    def word(self, name: str, address: Any) -> Signal:
        """The word at an address of the memory ``name``, read by an additional port."""
        memory, instance = self.parts[name].component, self.parts[name].module
        assert isinstance(instance, MemoryInstance)
        word = Signal(Shape.cast(memory.shape), name=f"{name}_word")
        bits = (memory.depth - 1).bit_length()
        full_address = Cat(address, Const(0, bits))[:bits]
        instance.read_port(
            domain="comb", addr=full_address, data=word, en=Const(1), transparent_for=()
        )
        return word
