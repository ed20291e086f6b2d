"""Every error the ArmarX bridge raises, under one root; each message names the thing and says what to do."""

from __future__ import annotations

from elm.errors import ElmError


class ArmemError(ElmError):
    """Root of all errors the bridge raises on purpose. Catch this to catch them all."""


# ARON


class InvalidData(ArmemError, ValueError):
    """A value cannot be the ARON data object it is given as. Correct the value, or take another kind of object."""


class InvalidTypeObject(ArmemError, ValueError):
    """A type object contradicts itself (a member twice, a pair of three ...). Correct the definition."""


class InvalidDefinition(ArmemError, ValueError):
    """A file of type definitions cannot be read. The message names file and line."""


class NotConvertible(ArmemError, TypeError):
    """A Python value has no ARON form, or a data object not the Python form asked for. The message says which."""


class NotRealized(ArmemError, ValueError):
    """A data object does not realize the type object it should be of. The message lists the paths."""


class Undecodable(ArmemError, ValueError):
    """Bytes or text are not an ARON object in the bridge's form. They are damaged, or come from elsewhere."""


class UnknownCodecVersion(Undecodable):
    """An object was written by a later generation of the bridge. Upgrade elm to read it."""


class TooLarge(ArmemError, ValueError):
    """An encoded object is over the limit of bytes. Raise the limit, or keep the data elsewhere."""


class LayoutMismatch(ArmemError, ValueError):
    """Data objects whose numbers do not sit in the same places were taken for vectors of one space."""
