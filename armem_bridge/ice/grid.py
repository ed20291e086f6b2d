"""What the bridge asks of a robot's registry, whichever it is: objects by their names, topics, its administration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from armem_bridge.ice.communicators import identity
from armem_bridge.ice.installation import load_ice, load_package
from armem_bridge.ice.refusals import Unreachable
from armem_bridge.ice.topics import MANAGER

USER: Final = "user"
PASSWORD: Final = "password"  # noqa: S105 - what all clients of ArmarX use: the registry checks none
"""Whom administration sessions are opened for."""


class Grid:
    """A registry, through the default locator of a communicator."""

    def __init__(self, communicator: Any) -> None:
        self._communicator = communicator
        self._ice, self._grid, self._storm = load_ice(), load_package("IceGrid"), load_package("IceStorm")

    def find(self, name: str, prx: Any) -> Any | None:
        """The well-known object of that name; None where none is registered. Raises `Unreachable`."""
        return self._cast(prx, identity(name), name)

    def topic(self, name: str) -> Any:
        """The topic of that name, made if there is none yet. Raises `Unreachable`."""
        manager = self._cast(self._storm.TopicManagerPrx, identity(*MANAGER), "IceStorm/TopicManager")
        if manager is None:
            raise Unreachable("the registry knows no IceStorm/TopicManager: start IceStorm, and register it")
        while True:
            try:
                return manager.retrieve(name)
            except self._storm.NoSuchTopic:
                try:
                    return manager.create(name)
                except self._storm.TopicExists:
                    # Somebody else was as quick.
                    continue

    def register(self, proxy: Any) -> None:
        """Make an object known by its identity, in the place of one of that identity."""
        with self._administration() as admin:
            try:
                admin.addObjectWithType(proxy, proxy.ice_staticId())
            except self._grid.ObjectExistsException:
                admin.updateObject(proxy)

    def unregister(self, proxy: Any) -> None:
        """Let an object be unknown again."""
        with self._administration() as admin:
            try:
                admin.removeObject(proxy.ice_getIdentity())
            except self._grid.ObjectNotRegisteredException:
                # That is what was wanted.
                return

    @contextmanager
    def _administration(self) -> Iterator[Any]:
        registry = self._cast(self._grid.RegistryPrx, identity("Registry", "IceGrid"), "IceGrid/Registry")
        if registry is None:
            raise Unreachable("the locator knows no IceGrid/Registry: give that of an IceGrid")
        try:
            session = registry.createAdminSession(USER, PASSWORD)
        except self._grid.PermissionDeniedException as error:
            raise Unreachable(f"the registry opens no administration session for {USER!r}: {error.reason}") from error
        try:
            yield session.getAdmin()
        finally:
            session.destroy()

    def _cast(self, prx: Any, name: Any, shown: str) -> Any | None:
        locator = self._communicator.getDefaultLocator()
        if locator is None:
            raise Unreachable(f"no locator is set to look for {shown} with: give Ice.Default.Locator")
        try:
            found = prx.checkedCast(self._communicator.stringToProxy(self._ice.identityToString(name)))
        except self._ice.NotRegisteredException:
            return None
        except self._ice.LocalException as error:
            raise Unreachable(
                f"{shown} cannot be reached through {locator}: {type(error).__name__}. Is the registry running there?"
            ) from error
        return found
