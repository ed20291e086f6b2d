"""The memories that are measured, behind Ice, in a process of their own: it serves on loopback until its stdin ends."""

from __future__ import annotations

import sys

from armem_bridge.ice import Standalone, load_slices
from simulators.armem.data_objects import KINDS
from simulators.armem.echo import FOURTH
from simulators.armem.preloaded import make_server


def serve() -> None:
    """Serve one memory for each kind of objects; the first line of stdout says at which locator."""
    servers = [make_server(kind) for kind in KINDS.values()]
    with Standalone(load_slices([FOURTH]), servers, port=0) as edge:
        print(edge.locator, flush=True)
        sys.stdin.read()
    for server in servers:
        server.close()


if __name__ == "__main__":
    serve()
