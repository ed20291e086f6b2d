"""A topic manager as IceStorm's clients know it: topics, their subscribers, and a publisher that forwards all calls."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from threading import RLock
from typing import Any

from armem_bridge.ice.communicators import identity, servant_of
from armem_bridge.ice.installation import load_ice, load_package

_logger = logging.getLogger(__name__)

MANAGER = ("TopicManager", "IceStorm")
"""The identity of the topic manager, which all clients know."""


class Topics:
    """The topics of a robot without IceStorm; one is made when somebody asks for it.

    `on_audience` is told the name of a topic when its first subscriber comes and when the last one is gone;
    it then asks the topic which of both is true now, for others may have come or gone meanwhile.
    """

    def __init__(self, adapter: Any, on_audience: Callable[[str], None]) -> None:
        self._adapter = adapter
        self._on_audience = on_audience
        self._storm = load_package("IceStorm")
        self._lock = RLock()
        self._topics: dict[str, Topic] = {}
        self.proxy = adapter.add(
            servant_of(
                self._storm.TopicManager, create=self._create, retrieve=self._retrieve, retrieveAll=self._retrieve_all
            ),
            identity(*MANAGER),
        )

    def topic(self, name: str) -> Topic:
        """The topic of that name."""
        with self._lock:
            found = self._topics.get(name)
            if found is None:
                found = self._topics[name] = Topic(name, self._adapter, self._on_audience, self._destroyed)
            return found

    def _create(self, name: str, current: Any) -> Any:
        with self._lock:
            if name in self._topics:
                raise self._storm.TopicExists(name)
            return self.topic(name).proxy

    def _retrieve(self, name: str, current: Any) -> Any:
        with self._lock:
            if name not in self._topics:
                raise self._storm.NoSuchTopic(name)
            return self._topics[name].proxy

    def _retrieve_all(self, current: Any) -> dict[str, Any]:
        with self._lock:
            return {name: topic.proxy for name, topic in self._topics.items()}

    def _destroyed(self, name: str) -> None:
        with self._lock:
            self._topics.pop(name, None)


class Topic:
    """One topic. A subscriber that cannot be reached is dropped, as by IceStorm."""

    def __init__(
        self, name: str, adapter: Any, on_audience: Callable[[str], None], on_destroyed: Callable[[str], None]
    ) -> None:
        ice = load_ice()
        self.name = name
        self._storm = load_package("IceStorm")
        self._adapter = adapter
        self._on_audience, self._on_destroyed = on_audience, on_destroyed
        self._lock = RLock()
        self._subscribers: dict[Any, Any] = {}
        prx = self._storm.TopicPrx
        operations: dict[str, Callable[..., Any]] = {
            "getName": lambda current: self.name,
            "getPublisher": lambda current: self.publisher,
            "getNonReplicatedPublisher": lambda current: self.publisher,
            "subscribeAndGetPublisher": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "getSubscribers": lambda current: list(self._subscribers),
            "getLinkInfoSeq": lambda current: [],
            "destroy": self._destroy,
        }
        self.proxy = prx.uncheckedCast(
            adapter.add(servant_of(self._storm.Topic, **operations), identity(f"topic.{name}", "IceStorm"))
        )
        self.publisher = adapter.add(
            servant_of(ice.Blobject, ice_invoke=self._forward_to_all), identity("publish", f"topic.{name}")
        )

    @property
    def has_audience(self) -> bool:
        """Whether anybody is subscribed."""
        return bool(self._subscribers)

    def _subscribe(self, qos: Any, subscriber: Any, current: Any) -> Any:
        who = subscriber.ice_getIdentity()
        with self._lock:
            if who in self._subscribers:
                raise self._storm.AlreadySubscribed()
            self._subscribers[who] = subscriber if subscriber.ice_isDatagram() else subscriber.ice_oneway()
        # Not under the lock: who is told may wait for a message that is being forwarded.
        self._on_audience(self.name)
        only = servant_of(load_ice().Blobject, ice_invoke=partial(self._forward_to_one, who))
        return self._adapter.addWithUUID(only)

    def _unsubscribe(self, subscriber: Any, current: Any) -> None:
        self._drop(subscriber.ice_getIdentity())

    def _destroy(self, current: Any) -> None:
        for who in list(self._subscribers):
            self._drop(who)
        self._on_destroyed(self.name)
        self._adapter.remove(self.proxy.ice_getIdentity())
        self._adapter.remove(self.publisher.ice_getIdentity())

    def _drop(self, who: Any) -> None:
        with self._lock:
            known = self._subscribers.pop(who, None)
        if known is not None:
            self._on_audience(self.name)

    def _forward_to_all(self, parameters: bytes, current: Any) -> tuple[bool, bytes]:
        with self._lock:
            self._forward(list(self._subscribers), parameters, current)
        return True, b""

    def _forward_to_one(self, who: Any, parameters: bytes, current: Any) -> tuple[bool, bytes]:
        with self._lock:
            self._forward([who], parameters, current)
        return True, b""

    def _forward(self, whom: Sequence[Any], parameters: bytes, current: Any) -> None:
        """Hand a call on, under the lock, so that all subscribers get all calls in the same order."""
        for who in whom:
            subscriber = self._subscribers.get(who)
            if subscriber is not None:
                sent = subscriber.ice_invokeAsync(current.operation, current.mode, parameters, current.ctx)
                sent.add_done_callback(partial(self._sent, who))

    def _sent(self, who: Any, sent: Any) -> None:
        error = sent.exception()
        if error is not None:
            _logger.info("a subscriber of %s is dropped, for it cannot be reached: %s", self.name, error)
            self._drop(who)
