"""What the Ice edge refuses, and what it cannot do without."""

from __future__ import annotations

from armem_bridge.errors import ArmemError


class IceMissing(ArmemError, ImportError):
    """Ice for Python is not installed. Install it: it is an extra, with a licence of its own (GPL)."""


class SlicesMissing(ArmemError, FileNotFoundError):
    """The slice files of ArmarX are not where they were looked for. Name the directories of the workspace."""


class SlicesUnreadable(ArmemError, ValueError):
    """Slice files cannot be loaded, or lack what the bridge needs. The message names the file or the member."""


class UnknownGeneration(SlicesUnreadable):
    """The slice files are of a generation of the interface that the bridge does not speak."""


class MalformedMessage(ArmemError, ValueError):
    """Something that came over the wire cannot be what it is sent as. The message says what is wrong."""


class NotExpressible(ArmemError, ValueError):
    """A query cannot be sent: the loaded slice files have no class for it. Ask in another way."""


class RemoteFailure(ArmemError, RuntimeError):
    """A memory server or name system answered that it failed; the message is its own."""


class Unreachable(ArmemError, ConnectionError):
    """A registry, name system or topic manager cannot be reached, or does not know what was asked for."""
