"""What long-term memory refuses, as errors; what is wrong with single snapshots it reports in its status instead."""

from __future__ import annotations

from armem_bridge.errors import ArmemError


class NoSnapshot(ArmemError, ValueError):
    """An event is not a consolidated snapshot, or a damaged one. Leave it out, or correct who wrote it."""


class InvalidArchive(ArmemError, ValueError):
    """Long-term memory cannot be set up like this (a backlog of 0, a path that is none ...). Correct its settings."""


class BacklogFull(ArmemError):
    """So much waits to be consolidated that nothing more is taken. Look after the database, or commit less."""


class NotConsolidated(ArmemError):
    """Snapshots could not be made durable in time. The message says how many, and what the database said."""


class ArchiveClosed(ArmemError):
    """Long-term memory was closed. Make a new one."""
