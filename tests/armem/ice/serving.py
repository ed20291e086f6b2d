"""A memory server in a process of its own, for tests: says where it is, then does what lines on stdin say."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import armem_bridge.aron.type_objects as t
from armem_bridge.ice import Edge, Joined, Standalone, load_slices
from armem_bridge.working import CoreSegmentDefinition, MemoryServer

SLICES = Path(__file__).with_name("slices")

GRASP = t.Object(name="Grasp", members={"name": t.String(), "force": t.Double(maybe=True)})


def make_server(name: str) -> MemoryServer:
    """A memory with one core segment for anything and one for grasps."""
    cores = (CoreSegmentDefinition(name="Instance"), CoreSegmentDefinition(name="Grasp", aron_type=GRASP))
    return MemoryServer(name, cores)


def main(generation: str, name: str, locator: str) -> None:
    """Serve until stdin ends: alone, or with a `locator` as a further memory of that robot."""
    words = load_slices([SLICES / generation])
    server = make_server(name)
    edge: Standalone | Joined
    if locator == "alone":
        edge = Standalone(words, [server], port=0)
        where = edge.locator
    else:
        edge = Joined(words, [server], locator=locator, endpoint="tcp -h 127.0.0.1", own_name_system=True)
        where = locator
    with edge, server:
        answer(where)
        for line in sys.stdin:
            order, *arguments = json.loads(line)
            answer(ORDERS[order](edge, server, *arguments))


def answer(value: object) -> None:
    """One line of JSON."""
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


def edge_status(edge: Edge, _: MemoryServer) -> dict[str, Any]:
    """What the edge tells of itself."""
    status = edge.status()
    return {name: getattr(status, name) for name in ("generation", "versions", "malformed", "untimed", "waiting")}


def server_status(_: Edge, server: MemoryServer) -> dict[str, Any]:
    """What the memory tells of itself."""
    status = server.status()
    return {"commits": status.commits, "snapshots": status.snapshots, "listeners": len(status.listeners)}


def add_memory(edge: Edge, _: MemoryServer, name: str) -> None:
    """One more memory, made known to all."""
    assert isinstance(edge, Standalone | Joined)
    edge.add(make_server(name))


ORDERS: dict[str, Callable[..., object]] = {
    "edge": edge_status,
    "server": server_status,
    "add": add_memory,
}

if __name__ == "__main__":
    main(*sys.argv[1:])
