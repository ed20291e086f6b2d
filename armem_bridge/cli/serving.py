"""`elm armem serve`: the memory servers of a configuration, until somebody says stop."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from threading import Event as Signal
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.stopping import set_by_signals, warnings_said
from elm.cli.terminal import say

if TYPE_CHECKING:
    from armem_bridge.config import Configuration
    from armem_bridge.service import Service, ServiceStatus

LOOK_EVERY = 0.2
"""Seconds between two looks at whether to stop."""
TELL_EVERY = 60.0
"""Seconds between two lines about how things are, where something has changed."""


def serve(
    *,
    config: Annotated[
        Path, typer.Option("--config", metavar="FILE", dir_okay=False, help="The configuration, a TOML file.")
    ],
    check: Annotated[
        bool, typer.Option("--check", help="Only read the configuration and what it names, and say what it comes to.")
    ] = False,
) -> None:
    """Serve the memories of a configuration to ArmarX clients, through Ice, until Ctrl-C or SIGTERM.

    At the stop what still waits is consolidated into long-term memory; a second Ctrl-C or SIGTERM ends it at once.
    """
    from armem_bridge.config import InvalidConfiguration, Mode, read_config

    given = read_config(config)
    if check:
        for line in _described(given):
            say(line)
        return
    if given.ice.mode is Mode.NONE:
        raise InvalidConfiguration(
            f'{config}: ice.mode: nobody could reach these memories: set mode = "standalone" or "join" in [ice]. '
            f"Without Ice they are for a program of your own: armem_bridge.service.Service(read_config(FILE))"
        )
    _serve(given)


def _serve(config: Configuration) -> None:
    from armem_bridge.service import Service

    service, stop = Service(config), Signal()
    with warnings_said("elm", "armem_bridge"), set_by_signals(stop):
        service.start()
        try:
            say(f"serving {', '.join(service.servers)} at {service.address}")
            _tell_until(stop, service)
            waiting = service.status().long_term.get("backlog", 0)
            say(f"stopping: {waiting:,} snapshots wait to be consolidated" if waiting else "stopping")
        finally:
            service.stop()
    say(f"stopped: {_told(service.status())}")


def _tell_until(stop: Signal, service: Service) -> None:
    said, due = "", monotonic() + TELL_EVERY
    while not stop.wait(LOOK_EVERY):
        if monotonic() >= due:
            told = _told(service.status())
            if told != said:
                say(told)
            said, due = told, monotonic() + TELL_EVERY


def _told(status: ServiceStatus) -> str:
    updates = sum(each.updates for each in status.memories)
    refused = sum(each.refused for each in status.memories)
    queries = sum(each.queries for each in status.memories)
    snapshots = sum(each.snapshots for each in status.memories)
    told = [f"{updates:,} updates, {refused:,} refused, {queries:,} queries, {snapshots:,} snapshots in working memory"]
    known = status.long_term
    if known:
        told.append(f"{known['consolidated']:,} consolidated, {known['backlog']:,} waiting")
        if known["set_aside"]:
            told.append(f"{known['set_aside']:,} could not be")
        if known["failing_seconds"]:
            told.append(f"failing: {known['last_error']}")
    return "; ".join(told)


def _described(config: Configuration) -> Iterator[str]:
    from armem_bridge.service import memory_server

    for memory in config.memories:
        # What is wrong with its prior knowledge turns up here.
        memory_server(memory).close()
        segments = ", ".join(
            f"{core.name}{'' if core.aron_type is None else ' (typed)'}" for core in memory.core_segments
        )
        yield f"memory {memory.name}: {segments}"
    known = config.long_term
    yield "no long-term memory" if known is None else f"long-term memory {known.memory}: {known.settings.when}"
    online, offline = len(config.online), len(config.offline)
    yield f"forgetting: {online} mechanisms online, {offline} offline"
    yield f"ice: {config.ice.mode}"
