"""Every target: a part of a family at a speed grade, by its name."""

from __future__ import annotations

from typing import Final

from boresight.gateware.synthesis.area_alone import ARTIX7, CYCLONE5
from boresight.gateware.synthesis.ecp5.family import ECP5
from boresight.gateware.synthesis.family import Family, Target
from boresight.gateware.synthesis.gowin.family import GW2A, GW5A
from boresight.gateware.synthesis.ice40.family import ICE40
from boresight.gateware.synthesis.nexus.family import NEXUS
from boresight.gateware.synthesis.spartan6.family import SPARTAN6

#: Families with parts of their own.
FAMILIES: Final[tuple[Family, ...]] = (SPARTAN6, ECP5, ICE40, NEXUS, GW2A, GW5A, ARTIX7, CYCLONE5)


def _targets() -> dict[str, Target]:
    """Name the parts; the slowest grade has no number in its name."""
    out = {}
    for family in FAMILIES:
        for device in family.devices:
            for k, grade in enumerate(device.grades):
                name = f"{device.name}-{grade}" if k else device.name
                out[name] = Target(name, family, device, grade)
    return out


#: Targets by name.
TARGETS: Final[dict[str, Target]] = _targets()
