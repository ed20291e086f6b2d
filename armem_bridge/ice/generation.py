"""Which generation of the memory interface slice files are of, told from what is in them."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from armem_bridge.ice.refusals import UnknownGeneration


class Generation(IntEnum):
    """The generations that the bridge speaks. No file says its number: they differ in these names."""

    THIRD = 3
    """March 2022 to March 2023: `timeCreated` and `timeSent`, the version of ARON is text."""

    FOURTH = 4
    """Since then: `referencedTime` and `sentTime`, the version of ARON is a value of its own."""


def detect_generation(update: Any, aron: Any, origin: str) -> Generation:
    """The generation of an interface, by the members of an entity update and of the module of ARON.

    Raises `UnknownGeneration` for older ones, for a mixture, and for what looks like neither.
    """
    members = set(vars(update()))
    third = {"timeCreated", "timeSent"} <= members
    fourth = {"referencedTime", "sentTime"} <= members
    versioned = hasattr(aron, "Version")
    if fourth and versioned and not third:
        return Generation.FOURTH
    if third and not versioned and not fourth:
        return Generation.THIRD
    if any(name.endswith("MicroSeconds") for name in members):
        raise UnknownGeneration(
            f"the slice files in {origin} are of the first or second generation of the memory interface "
            f"(times are plain numbers): the bridge speaks the third and the fourth, of 2022 and later"
        )
    raise UnknownGeneration(
        f"the slice files in {origin} are of no generation that the bridge speaks: an EntityUpdate has "
        f"{', '.join(sorted(members))}, and ARON has {'a' if versioned else 'no'} Version. The third has timeCreated, "
        f"timeSent and no Version, the fourth referencedTime, sentTime and Version. A mixture comes from packages "
        f"of different dates: update ArmarXCore and RobotAPI together"
    )
