"""What a memory server refuses, as errors; what is wrong with single updates it says in their results instead."""

from __future__ import annotations

from armem_bridge.errors import ArmemError


class InvalidQuery(ArmemError, ValueError):
    """A query cannot be answered as it is (a bad expression, a time not set ...). Correct what the message names."""


class InvalidCommit(ArmemError, ValueError):
    """What is committed is no `Commit` of updates, or what is wished for no list of segments. Make it one."""


class InvalidSubscription(ArmemError, ValueError):
    """Nobody can listen like this (an ID that is text, a queue of 0 ...). Correct what the message names."""


class InvalidServer(ArmemError, ValueError):
    """A memory server cannot be set up like this (a segment twice, a limit of 0 ...). Correct its definition."""


class InvalidPriorKnowledge(ArmemError, ValueError):
    """A file of prior knowledge cannot be read. The message names the file and the place in it."""


class ServerClosed(ArmemError):
    """The memory server was closed. Make a new one."""
