"""A registry as IceGrid's clients know it: finds objects by their identities, and takes in new ones."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from threading import Lock
from typing import Any

from armem_bridge.ice.communicators import identity, servant_of
from armem_bridge.ice.installation import load_ice, load_package


class Registry:
    """Locator, registry, query and administration of a robot without IceGrid, as far as memory clients need them.

    Anybody may open a session, for nobody but this machine can reach it. There are no nodes to deploy
    servers on: a ping of any is answered with yes, because clients test their connection so.
    """

    def __init__(self, adapter: Any) -> None:
        ice, grid = load_ice(), load_package("IceGrid")
        self._ice, self._grid = ice, grid
        self._adapter = adapter
        self._lock = Lock()
        self._objects: dict[Any, tuple[Any, str]] = {}
        self._adapters: dict[str, Any] = {}
        self._locator_registry = ice.LocatorRegistryPrx.uncheckedCast(
            adapter.addWithUUID(
                servant_of(
                    ice.LocatorRegistry,
                    setAdapterDirectProxy=lambda name, proxy, current: self._set_adapter(name, proxy),
                    setReplicatedAdapterDirectProxy=lambda name, group, proxy, current: self._set_adapter(
                        name, proxy, group
                    ),
                    setServerProcessProxy=lambda name, proxy, current: None,
                )
            )
        )
        registry = self._add(grid.Registry, "Registry", createAdminSession=self._open_session)
        query = self._add(
            grid.Query,
            "Query",
            findObjectById=lambda name, current: self._known(name),
            findObjectByType=lambda kind, current: next(iter(self._of_type(kind)), None),
            findAllObjectsByType=lambda kind, current: self._of_type(kind),
        )
        self.locator = self._add(
            grid.Locator,
            "Locator",
            findObjectById=self._find_object,
            findAdapterById=self._find_adapter,
            getRegistry=lambda current: self._locator_registry,
            getLocalRegistry=lambda current: grid.RegistryPrx.uncheckedCast(registry),
            getLocalQuery=lambda current: grid.QueryPrx.uncheckedCast(query),
        )
        self._admin = grid.AdminPrx.uncheckedCast(
            self._add(
                grid.Admin,
                "Admin",
                addObject=lambda proxy, current: self._add_object(proxy, proxy.ice_id()),
                addObjectWithType=lambda proxy, kind, current: self._add_object(proxy, kind),
                updateObject=lambda proxy, current: self._update_object(proxy),
                removeObject=lambda name, current: self._remove_object(name),
                getObjectInfo=lambda name, current: self._info(name),
                getObjectInfosByType=lambda kind, current: self._infos(lambda _, known: known == kind),
                getAllObjectInfos=lambda pattern, current: self._infos(
                    lambda name, _: fnmatchcase(ice.identityToString(name), pattern or "*")
                ),
                getAllNodeNames=lambda current: [],
                pingNode=lambda name, current: True,
            )
        )

    def put(self, proxy: Any, kind: str) -> None:
        """Register an object of our own, in the place of another of its identity."""
        with self._lock:
            self._objects[proxy.ice_getIdentity()] = (proxy, kind)

    def _add(self, interface: Any, name: str, **operations: Callable[..., Any]) -> Any:
        proxy = self._adapter.add(servant_of(interface, **operations), identity(name, "IceGrid"))
        self.put(proxy, interface.ice_staticId())
        return proxy

    # Locator

    def _known(self, name: Any) -> Any:
        with self._lock:
            proxy, _ = self._objects.get(name, (None, ""))
        return proxy

    def _find_object(self, name: Any, current: Any) -> Any:
        found = self._known(name)
        if found is None:
            raise self._ice.ObjectNotFoundException()
        return found

    def _find_adapter(self, name: str, current: Any) -> Any:
        with self._lock:
            if name not in self._adapters:
                raise self._ice.AdapterNotFoundException()
            return self._adapters[name]

    def _set_adapter(self, *names_and_proxy: Any) -> None:
        name, proxy, *group = names_and_proxy
        with self._lock:
            for each in (name, *group):
                if proxy is None:
                    self._adapters.pop(each, None)
                else:
                    self._adapters[each] = proxy

    def _of_type(self, kind: str) -> list[Any]:
        with self._lock:
            return [proxy for proxy, known in self._objects.values() if known == kind]

    # Administration

    def _open_session(self, user: str, password: str, current: Any) -> Any:
        session = self._adapter.addWithUUID(
            servant_of(
                self._grid.AdminSession,
                getAdmin=lambda current: self._admin,
                keepAlive=lambda current: None,
                destroy=lambda current: current.adapter.remove(current.id),
            )
        )
        return self._grid.AdminSessionPrx.uncheckedCast(session)

    def _add_object(self, proxy: Any, kind: str) -> None:
        name = proxy.ice_getIdentity()
        with self._lock:
            if name in self._objects:
                raise self._grid.ObjectExistsException(name)
            self._objects[name] = (proxy, kind)

    def _update_object(self, proxy: Any) -> None:
        name = proxy.ice_getIdentity()
        with self._lock:
            if name not in self._objects:
                raise self._grid.ObjectNotRegisteredException(name)
            self._objects[name] = (proxy, self._objects[name][1])

    def _remove_object(self, name: Any) -> None:
        with self._lock:
            if self._objects.pop(name, None) is None:
                raise self._grid.ObjectNotRegisteredException(name)

    def _info(self, name: Any) -> Any:
        with self._lock:
            if name not in self._objects:
                raise self._grid.ObjectNotRegisteredException(name)
            return self._grid.ObjectInfo(*self._objects[name])

    def _infos(self, wanted: Callable[[Any, str], bool]) -> list[Any]:
        with self._lock:
            return [
                self._grid.ObjectInfo(proxy, kind)
                for name, (proxy, kind) in self._objects.items()
                if wanted(name, kind)
            ]
