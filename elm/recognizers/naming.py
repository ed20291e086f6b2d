"""Names in definitions: those of features and of parent types, kept so that equal definitions are spelled the same."""

from __future__ import annotations

from collections.abc import Iterable, Set

from elm.errors import InvalidValue
from elm.taxonomy import EventType
from elm.text import check_name


def ordered_names(given: Iterable[str], *, what: str) -> tuple[str, ...]:
    """The names of features whose order counts, each once: a set has none, and is refused."""
    if isinstance(given, Set):
        raise InvalidValue(f"{what} is feature names in an order, which a set does not have: give them as a list")
    return tuple(_checked(given, what=what))


def sorted_names(given: Iterable[str], *, what: str) -> tuple[str, ...]:
    """The names of features whose order does not count, each once."""
    return tuple(sorted(_checked(given, what=what)))


def _checked(given: Iterable[str], *, what: str) -> dict[str, None]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise InvalidValue(f'{what} is several feature names, such as ["object"], not {given!r:.80}')
    return dict.fromkeys(check_name(name, what=f"a feature of {what}") for name in given)


def parents_of(type_name: str, given: Iterable[str]) -> tuple[str, ...]:
    """The parents of the types of a recognizer's results: a set, whose order does not count."""
    return tuple(sorted(EventType(name=type_name, parents=given).parents))  # type: ignore[arg-type]
