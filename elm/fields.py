"""Reading and writing the fields of one JSON object strictly: each must be known and of its kind, or it is named."""

from __future__ import annotations

import base64
import binascii
from datetime import UTC, datetime
from typing import Any
from uuid import UUID

import msgspec

from elm.errors import InvalidValue


class Fields:
    """The members of a JSON object, taken one by one; `finish` refuses what nobody asked for."""

    def __init__(self, given: Any, *, what: str) -> None:
        if not isinstance(given, dict):
            raise InvalidValue(f"{what} is a JSON object, not {shown(given)}")
        self._given = given
        self._what = what
        self._taken: set[str] = set()

    def what_of(self, key: str) -> str:
        """How messages call the member `key`."""
        return f"{key!r} of {self._what}"

    def take(self, key: str) -> Any:
        """The member `key`, which must be there."""
        self._taken.add(key)
        try:
            return self._given[key]
        except KeyError:
            raise InvalidValue(f"{self._what} lacks {key!r}") from None

    def optional(self, key: str, default: Any = None) -> Any:
        """The member `key`, or `default` where it is absent."""
        self._taken.add(key)
        return self._given.get(key, default)

    def finish(self) -> None:
        """Refuse members that were not asked for."""
        if unknown := self._given.keys() - self._taken:
            raise InvalidValue(
                f"{self._what} has no member {', '.join(map(repr, sorted(unknown)))}: "
                f"known are {', '.join(map(repr, sorted(self._taken)))}"
            )

    def text(self, key: str) -> str:
        """The text `key`."""
        value = self.take(key)
        if not isinstance(value, str):
            raise InvalidValue(f"{self.what_of(key)} must be text, not {shown(value)}")
        return value

    def number(self, key: str) -> int | float:
        """The number `key`."""
        value = self.take(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InvalidValue(f"{self.what_of(key)} must be a number, not {shown(value)}")
        return value

    def items(self, key: str) -> list[Any]:
        """The array `key`."""
        value = self.take(key)
        if not isinstance(value, list):
            raise InvalidValue(f"{self.what_of(key)} must be an array, not {shown(value)}")
        return value

    def texts(self, key: str) -> list[str]:
        """The array of texts `key`."""
        values = self.items(key)
        for value in values:
            if not isinstance(value, str):
                raise InvalidValue(f"{self.what_of(key)} must be an array of texts, not of {shown(value)}")
        return values

    def uids(self, key: str) -> tuple[UUID, ...]:
        """The array of uids `key`."""
        return tuple(parse_uid(value, what=self.what_of(key)) for value in self.items(key))

    def base64(self, key: str) -> bytes:
        """The bytes that the text `key` encodes in base64."""
        text = self.text(key)
        try:
            return base64.b64decode(text, validate=True)
        except (ValueError, binascii.Error) as error:
            raise InvalidValue(f"{self.what_of(key)} is not base64: {error}") from error


def shown(given: Any) -> str:
    """The beginning of a value for a message, as it stands in JSON."""
    try:
        text = msgspec.json.encode(given).decode()
    except (TypeError, ValueError, RecursionError):
        # No JSON: it came from Python.
        text = repr(given)
    return text[:80]


def parse_uid(given: Any, *, what: str) -> UUID:
    """The UUID a text names."""
    if isinstance(given, str):
        try:
            return UUID(given)
        except ValueError:
            pass
    raise InvalidValue(f"{what} is not a UUID: {shown(given)}")


def base64_text(data: bytes) -> str:
    """Bytes as base64 text."""
    return base64.b64encode(data).decode("ascii")


def time_text(moment: datetime) -> str:
    """A UTC datetime in RFC 3339, with as many digits as it has."""
    return moment.astimezone(UTC).isoformat().replace("+00:00", "Z")
