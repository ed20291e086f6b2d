"""Where the things are that a snapshot is about: a small disc around the poses that its data have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from threading import Lock
from typing import Final

from armem_bridge.long_term.poses import FrameTransform, NoPose, PosePath, globally, read_pose
from armem_bridge.working.snapshot import Snapshot
from elm.errors import InvalidValue
from elm.geometry import DEFAULT_FRAME, Region

RADIUS: Final = 0.05
"""The radius in metres of the disc around a pose unless told otherwise: about that of a cup."""


class SubjectFinder:
    """Finds the subject of snapshots by the poses that stand at configured paths in their data.

    The subject is a disc (a 32-gon) of `radius` metres around the pose, in the elm frame `frame`; of
    several poses the convex hull of their discs. Where a pose stands in a frame that nobody knows, or is
    none, it does not count, and `status` says how many did not; without any there is no subject.
    """

    def __init__(
        self,
        paths: Iterable[PosePath],
        *,
        radius: float = RADIUS,
        frame: str = DEFAULT_FRAME,
        transform: FrameTransform | None = None,
    ) -> None:
        # What is wrong with the settings is said now, not of every snapshot.
        Region.around(0.0, 0.0, radius, frame=frame)
        self._paths = tuple(paths)
        self._radius = radius
        self._frame = frame
        self._transform = transform
        self._counts: Counter[str] = Counter()
        self._lock = Lock()

    def subject(self, snapshot: Snapshot) -> Region | None:
        """Where the things are that a snapshot is about; None where its data do not say."""
        points: list[tuple[float, float]] = []
        for path in self._paths:
            if path.segment.contains(snapshot.id):
                points += self._points(path, snapshot)
        if not points:
            return None
        try:
            if len(points) == 1:
                return Region.around(*points[0], self._radius, frame=self._frame)
            return Region.hull(points, footprint=self._radius, frame=self._frame)
        except InvalidValue:
            self._count("unreadable_poses")
            return None

    def status(self) -> Mapping[str, int]:
        """How many poses were found, in frames that nobody knew, or unreadable."""
        with self._lock:
            return {name: self._counts[name] for name in ("poses", "untransformed_poses", "unreadable_poses")}

    def _points(self, path: PosePath, snapshot: Snapshot) -> Iterable[tuple[float, float]]:
        for instance in snapshot.instances:
            for data in path.path.find(instance.data):
                try:
                    pose = globally(read_pose(data, path.unit), self._transform, snapshot.referenced)
                except NoPose:
                    self._count("unreadable_poses")
                    continue
                if pose is None:
                    self._count("untransformed_poses")
                    continue
                self._count("poses")
                yield pose.position[:2]

    def _count(self, what: str) -> None:
        with self._lock:
            self._counts[what] += 1
