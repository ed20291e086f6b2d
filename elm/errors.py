"""Every error elm raises, under one root; each message names the thing and says what to do."""

from __future__ import annotations


class ElmError(Exception):
    """Root of all errors elm raises on purpose. Catch this to catch them all."""


# What a caller handed over


class InvalidValue(ElmError, ValueError):
    """A value cannot be what it is given as (a naive datetime, an empty polygon ...). Correct the value."""


class UnknownType(ElmError, LookupError):
    """An event or a cue names an event type that the memory does not have. Add it with `elm types add`."""


class UnknownEvent(ElmError, LookupError):
    """A uid or id names no event of this memory. Commit that event first, or correct the uid."""


class CycleRefused(ElmError, ValueError):
    """A type would be its own ancestor, or an event its own part. Remove one of the links named."""


class ConflictingContent(ElmError, ValueError):
    """The uid is taken by an event of other content. Use a new uid, or commit the same content."""


class ForgottenEvent(ElmError, LookupError):
    """The uid is that of a forgotten event which still counts as a part. It cannot come back: use a new uid."""


class ExtentRefused(ElmError, ValueError):
    """The extent given for a complex event is not the one its parts have. Leave it out: it derives."""


class MissingPackage(ElmError, ImportError):
    """An optional Python package is needed for this call. Install the extra that the message names."""


# Reading the log


class PositionLost(ElmError):
    """A consumer of the log is not where this process took it to be: another process moves it. Read it again."""


class UnknownConsumer(ElmError, LookupError):
    """The log has no consumer of this name. Register it first, or correct the name."""


class ConsumerBusy(ElmError):
    """Another process works under this consumer's name. Stop that one, or choose another name."""


# Recognition


class DefinitionChanged(ElmError):
    """A recognizer's definition is not the one that its version had in this memory. Raise its version."""


# What the database is missing


class DatabaseUnreachable(ElmError, ConnectionError):
    """No PostgreSQL server answers. Start it (`elm up`) or correct the DSN."""


class DatabaseUnfit(ElmError):
    """The server answers but cannot hold a memory: version, extension or rights. The message says which."""


class MemoryMissing(ElmError, LookupError):
    """The memory does not exist yet. It is created by the first write, or by `elm migrate`."""


class SchemaMismatch(ElmError):
    """The memory's schema is older or newer than this elm. Run `elm migrate`, or upgrade elm."""


class ClusterError(ElmError):
    """The private PostgreSQL cluster cannot be created, started or stopped. The message says why."""


class StoreClosed(ElmError):
    """The memory was closed. Open it again with `elm.connect`."""


class StoreFailure(ElmError):
    """The database refused a statement for a reason elm does not know. Please report it with `elm doctor`."""
