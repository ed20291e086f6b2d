"""How commands end: the exit codes, and which of them each error leads to."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType

from elm.errors import ClusterError, DatabaseUnreachable, ElmError


class ExitCode(IntEnum):
    """What scripts can tell from how elm ended."""

    OK = 0
    ERROR = 1
    USAGE = 2
    UNREACHABLE = 3
    NOTHING_MATCHED = 4
    INTERRUPTED = 130
    BROKEN_PIPE = 141


EXIT_CODES: Mapping[type[Exception], ExitCode] = MappingProxyType(
    {
        DatabaseUnreachable: ExitCode.UNREACHABLE,
        ClusterError: ExitCode.UNREACHABLE,
        ElmError: ExitCode.ERROR,
        Exception: ExitCode.ERROR,
    }
)
"""The code of an error is that of the nearest of its classes."""


def exit_code(error: Exception) -> ExitCode:
    """The code with which a command ends that raised `error`."""
    return next(EXIT_CODES[kind] for kind in type(error).__mro__ if kind in EXIT_CODES)


def message(error: Exception) -> str:
    """One line that says what went wrong."""
    match error:
        case ElmError():
            text = str(error)
        case OSError(strerror=str(reason), filename=None):
            text = reason
        case OSError(strerror=str(reason), filename=name):
            text = f"{name}: {reason}"
        case _:
            text = (
                f"internal error: {type(error).__name__}: {error}. "
                f"Please report it with the output of `elm doctor` and of the same command after `elm --debug`"
            )
    return " ".join(text.split())
