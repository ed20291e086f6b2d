"""The vocabulary: the classes of the loaded slice files that the bridge needs, found by their names and members."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from armem_bridge.ice.generation import detect_generation
from armem_bridge.ice.refusals import SlicesUnreadable


class Vocabulary:
    """What the bridge takes from the interface of a robot, whatever generation it is of.

    Modules hold the classes whose names are known to be in them. The few whose names are not known for
    certain are found by the members that make them what they are.
    """

    def __init__(self, armarx: ModuleType, origin: str) -> None:
        self.origin = origin
        """The directories of the slice files, for messages."""

        self.time = self._module("armarx.core.time.dto")
        self.aron = self._module("armarx.aron")
        self.aron_data = self._module("armarx.aron.data.dto")
        self.data = self._module("armarx.armem.data")
        self.query = self._module("armarx.armem.query.data")
        self.server = self._module("armarx.armem.server")
        self.mns = self._module("armarx.armem.mns")
        self.mns_data = self._module("armarx.armem.mns.dto")
        self.client = self._module("armarx.armem.client")
        self.generation = detect_generation(self.member(self.data, "EntityUpdate"), self.aron, origin)
        """Which generation of the interface this is."""

        self.metadata = self._like(self.data, "EntityInstanceMetadata", {"confidence"}, "Metadata")
        self.update_result = self._like(self.data, "EntityUpdateResult", {"success", "errorMessage", "snapshotID"})
        self.segment_result = self._like(self.data, "AddSegmentResult", {"success", "errorMessage", "segmentID"})
        self.all_servers = self._like(self.mns_data, "GetAllRegisteredServersResult", {"success", "servers"})
        self.waited_server = self._like(self.mns_data, "WaitForServerResult", {"success", "server"}, "WaitForServer")

    def member(self, module: Any, name: str) -> Any:
        """A class of a module. Raises `SlicesUnreadable` where the slice files define none of that name."""
        found = getattr(module, name, None)
        if found is None:
            raise SlicesUnreadable(f"the slice files in {self.origin} define no {module.__name__}.{name}")
        return found

    def inner(self, module: Any, name: str) -> Any:
        """A module in a module, or None."""
        return sys.modules.get(f"{module.__name__}.{name}")

    def _module(self, name: str) -> Any:
        module = sys.modules.get(name)
        if module is None:
            raise SlicesUnreadable(f"the slice files in {self.origin} define no module {name.replace('.', '::')}")
        return module

    def _like(self, module: Any, name: str, members: set[str], within: str = "") -> Any:
        """The class of that name, or else the only one in the module that has these members."""
        if hasattr(module, name):
            return getattr(module, name)
        found = [cls for cls in _classes(module) if within in cls.__name__ and members <= set(_members(cls))]
        if len(found) != 1:
            raise SlicesUnreadable(
                f"the slice files in {self.origin} define no {module.__name__}.{name}, and "
                f"{len(found) or 'no'} classes beside it with {', '.join(sorted(members))}"
            )
        return found[0]


def _classes(module: Any) -> Iterator[Any]:
    return (value for name, value in vars(module).items() if isinstance(value, type) and not name.endswith("Prx"))


def _members(cls: Any) -> Iterator[str]:
    try:
        return iter(vars(cls()))
    except TypeError:
        # An interface, which cannot be made.
        return iter(())
