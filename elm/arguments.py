"""What callers hand over as numbers, uids and several things: the checks that public calls and cues share."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from operator import index
from typing import Any, TypeVar
from uuid import UUID

from elm.errors import InvalidValue

_Given = TypeVar("_Given")


def as_whole(given: Any, *, what: str) -> int:
    """`given` as an int: the integers of numpy are whole numbers too, truth values and floats are none."""
    if not isinstance(given, bool):
        with suppress(TypeError):
            return index(given)
    raise InvalidValue(f"{what}, not {given!r:.80}")


def as_count(given: Any, *, what: str, least: int, most: int) -> int:
    """`given` as an int from `least` to `most`."""
    # What is right is taken first, for every recall comes by here.
    if type(given) is int and least <= given <= most:
        return given
    meant = f"{what} is a whole number from {least} to {most}"
    number = as_whole(given, what=meant)
    if not least <= number <= most:
        raise InvalidValue(f"{meant}, not {number}")
    return number


def as_uid(given: Any, *, what: str) -> UUID:
    """`given` as a UUID, which a text may name too."""
    if isinstance(given, UUID):
        return given
    if isinstance(given, str):
        with suppress(ValueError):
            return UUID(given)
    raise InvalidValue(f"{what} is a uid (uuid.UUID or its text), not {given!r:.80}")


def as_uids(given: Iterable[Any], *, what: str) -> tuple[UUID, ...]:
    """`given` as UUIDs, each of which a text may name too; neither one alone nor a text."""
    # What is right is taken without a call, for every event that is made comes by here.
    return tuple(
        [
            each if isinstance(each, UUID) else as_uid(each, what=f"each of {what}")
            for each in check_several(given, what=what)
        ]
    )


def as_uid_or_id(given: Any, *, what: str) -> UUID | int:
    """`given` as what names one event: a UUID, which a text may name too, or an id."""
    meant = f"{what} is named by its uid (uuid.UUID or its text) or its id (int)"
    if isinstance(given, UUID):
        return given
    if isinstance(given, str):
        with suppress(ValueError):
            return UUID(given)
    return as_whole(given, what=meant)


def check_callable(given: Any, *, what: str) -> None:
    """Refuse what is neither None nor a function."""
    if given is not None and not callable(given):
        raise InvalidValue(f"{what}, not {given!r:.80}")


def check_several(given: Iterable[_Given], *, what: str) -> Iterable[_Given]:
    """`given`, when it is several things that can be gone through: neither one alone nor a text."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InvalidValue(f"{what} are given as several, not as one: [{given!r:.80}]")
    return given
