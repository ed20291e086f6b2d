"""Long-term memory on elm: snapshots consolidated into events, found by queries and by cues of space and time."""

from __future__ import annotations

from armem_bridge.long_term.consolidation import LongTermMemory
from armem_bridge.long_term.event_types import ROOT
from armem_bridge.long_term.gate import Gate
from armem_bridge.long_term.mapping import arrival_of, snapshot_of, snapshot_uid
from armem_bridge.long_term.poses import FrameTransform, PosePath
from armem_bridge.long_term.recall import recall_snapshots, snapshots_cue
from armem_bridge.long_term.robot_place import LocationPort, PoseListener, RobotPlaces
from armem_bridge.long_term.settings import Consolidation, When
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.long_term.subjects import SubjectFinder

__all__ = [
    "ROOT",
    "Consolidation",
    "FrameTransform",
    "Gate",
    "LocationPort",
    "LongTermMemory",
    "LongTermSource",
    "PoseListener",
    "PosePath",
    "RobotPlaces",
    "SubjectFinder",
    "When",
    "arrival_of",
    "recall_snapshots",
    "snapshot_of",
    "snapshot_uid",
    "snapshots_cue",
]
