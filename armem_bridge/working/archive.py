"""The port behind working memory: where snapshots go that are to be kept, and where they are found again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Protocol, Self

import msgspec

from armem_bridge.errors import ArmemError
from armem_bridge.working.access_statistics import Usage
from armem_bridge.working.history import Source
from armem_bridge.working.snapshot import Snapshot


class Evicted(msgspec.Struct, frozen=True, kw_only=True):
    """A snapshot that left working memory, or a version that never got there, and how it was used."""

    snapshot: Snapshot
    usage: Usage
    superseded: bool = False
    """Whether it left because another version of the snapshot counts, which is in working memory."""


class NotKept(ArmemError, ValueError):
    """An archive can never keep some of the snapshots it was given. Correct those, and give it the others again."""

    refused: Mapping[int, str] = MappingProxyType({})
    """The reasons, by the positions in what it was given; of all that nothing was taken."""

    @classmethod
    def because(cls, refused: Mapping[int, str]) -> Self:
        """What is not kept and why, by the positions of one snapshot at least."""
        error = cls("; ".join(sorted(set(refused.values()))))
        error.refused = MappingProxyType(dict(refused))
        return error


class Archive(Protocol):
    """Long-term memory, as a memory server sees it. One archive may serve several memories."""

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        """Every version that a commit brought, before it is in working memory and before it is acknowledged.

        May wait, for durability or for room; the segments of the server do not change meanwhile, so it must not
        add any itself. An error refuses the updates: nothing of them is inserted. With `NotKept` only those
        that it names are refused, and this is called again with the others.
        """

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        """What leaves working memory: by a limit, by clearing a segment, or as a version that does not count.

        Called while working memory is locked, so that nobody misses the snapshots in between: it must only
        take note, and ask nothing of the server. Who needs to wait for room does so in `consolidate`,
        which every commit calls first.
        """

    def source(self, memory: str) -> Source | None:
        """The long-term memory of that name, None where there is none.

        It shows all that was handed over and kept, whether it is stored already or still waiting to be; also
        what comes after this call, for a source that was asked for before.
        """

    def status(self) -> Mapping[str, object]:
        """What an operator wants to see: backlog, failures ..."""
