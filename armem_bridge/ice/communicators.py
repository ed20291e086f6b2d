"""Communicators and servants: how the bridge sets up Ice, on both sides."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from armem_bridge.aron.data import DEPTH_LIMIT
from armem_bridge.ice.installation import load_ice

MESSAGE_KILOBYTES: Final = 1_048_576
"""The greatest message, in kilobytes: images and point clouds are larger than the one megabyte that Ice allows."""

PROPERTIES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "Ice.MessageSizeMax": str(MESSAGE_KILOBYTES),
        "Ice.ThreadPool.Server.Size": "2",
        "Ice.ThreadPool.Server.SizeMax": "8",
        "Ice.ThreadPool.Client.SizeMax": "4",
        # Data objects may nest that deep, with the containers of a result around them.
        "Ice.ClassGraphDepthMax": str(DEPTH_LIMIT + 20),
    }
)
"""What the bridge sets where the user does not."""


def make_communicator(properties: Mapping[str, str] | None = None) -> Any:
    """A communicator with the bridge's properties, and the user's over them. Raises `IceMissing`."""
    ice = load_ice()
    chosen = ice.createProperties()
    for name, value in {**PROPERTIES, **(properties or {})}.items():
        chosen.setProperty(name, value)
    initialization = ice.InitializationData()
    initialization.properties = chosen
    return ice.initialize(initialization)


def servant_of(interface: Any, **operations: Callable[..., Any]) -> Any:
    """A servant of an interface of loaded slice files that answers its operations with these functions.

    Each is called with the operation's parameters and Ice's `current`, from any of Ice's threads.
    """
    servant = type(f"{interface.__name__}Servant", (interface,), {})()
    vars(servant).update(operations)
    return servant


def identity(name: str, category: str = "") -> Any:
    """An identity; names may have slashes in them, which its text would take for a category's end."""
    return load_ice().Identity(name, category)
