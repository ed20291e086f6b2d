"""What text may be kept: the checks that names and values share, so that every store can hold what is accepted."""

from __future__ import annotations

import re

from elm.errors import InvalidValue

NAME_BYTES = 500
"""Longest name of a type, frame or agent, in bytes of UTF-8: an index entry holds it whole."""
_MEMORY = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,47}")
_RESERVED = {"public", "information_schema", "topology", "tiger", "tiger_data"}


def check_text(value: str, *, what: str) -> str:
    """`value` as plain str, when every store can keep it: no NUL, no half of a surrogate pair."""
    if not isinstance(value, str):
        raise InvalidValue(f"{what} must be text, not {type(value).__name__}: {value!r}")
    if "\x00" in value:
        raise InvalidValue(f"{what} contains a NUL character: {value[:60]!r}. Remove it")
    if not value.isascii():
        try:
            value.encode()
        except UnicodeEncodeError as error:
            raise InvalidValue(
                f"{what} contains half of a surrogate pair, which is no character: {value[:60]!r}"
            ) from error
    # Of an enumeration the text it is, not the name it shows.
    return value if type(value) is str else str.__str__(value)


def check_name(value: str, *, what: str) -> str:
    """`value`, when it can name a type, frame, agent or feature: not empty, no control separator."""
    value = check_text(value, what=what)
    if not value:
        raise InvalidValue(f"{what} is empty: give it a name")
    if "\x1f" in value:
        raise InvalidValue(f"{what} contains the control character U+001F: {value[:60]!r}. Remove it")
    return value


def check_short_name(value: str, *, what: str) -> str:
    """`value`, when it is a name of at most `NAME_BYTES` bytes of UTF-8."""
    value = check_name(value, what=what)
    if len(value) > NAME_BYTES or (not value.isascii() and len(value.encode()) > NAME_BYTES):
        raise InvalidValue(f"{what} is longer than {NAME_BYTES} bytes: {value[:60]!r}... Shorten it")
    return value


def check_memory_name(name: str) -> str:
    """`name`, when a memory can be called that in every store: in a database it is the name of its schema."""
    if not isinstance(name, str) or not _MEMORY.fullmatch(name):
        raise InvalidValue(
            f"a memory's name is up to 48 letters, digits, '_', '-' and '.', a letter first, not {name!r}"
        )
    if name.lower() in _RESERVED or name.lower().startswith("pg_"):
        raise InvalidValue(f"{name!r} is a name that PostgreSQL keeps for itself: choose another")
    return name
