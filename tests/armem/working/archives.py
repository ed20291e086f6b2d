"""An archive in main memory that keeps everything, in a list that it looks through at every question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from armem_bridge.working import Evicted, Snapshot
from armem_bridge.working.history import Source
from tests.armem.working.oracle import NaiveSource


class ListArchive:
    """Keeps what it was told to keep: every version that was committed, or only what left working memory."""

    def __init__(self, *, on_eviction_only: bool = False, kept: Sequence[Snapshot] = ()) -> None:
        self.kept: list[Snapshot] = list(kept)
        self.consolidated: list[Snapshot] = []
        self.evicted: list[Evicted] = []
        self._on_eviction_only = on_eviction_only

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        self.consolidated += snapshots
        if not self._on_eviction_only:
            self.kept += snapshots

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        self.evicted += evicted
        if self._on_eviction_only:
            self.kept += [each.snapshot for each in evicted]

    def source(self, memory: str) -> Source | None:
        return NaiveSource(self.kept) if memory == "Object" else None

    def status(self) -> Mapping[str, object]:
        return {"kept": len(self.kept)}


class BrokenArchive(ListArchive):
    """An archive whose disk is full."""

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        raise OSError("no space left on device")


class ForgetfulArchive(ListArchive):
    """An archive that breaks down when it is given what leaves working memory."""

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        raise OSError("no space left on device")
