"""The ARON type that a configuration gives a core segment: one of table A.1 by its name, or one from a file."""

from __future__ import annotations

from difflib import get_close_matches

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES, BY_PLAIN_NAME, plain_name
from armem_bridge.aron.definitions import read_definitions
from armem_bridge.config.refusals import Place
from armem_bridge.config.tables import TypeTable


def segment_type(given: str | TypeTable, at: Place) -> t.TypeObject:
    """The type object. Only one that an instance's data, which are a Dict, can realize is the type of a segment."""
    found, name = (_of_table_a1(given, at), given) if isinstance(given, str) else _of_file(given, at)
    if not isinstance(found, t.Object | t.Dict | t.Any):
        at.refuse(
            f"the data of an instance are a Dict, and {name} is realized by {type(found).__name__}: "
            f"take a type with members, one of which is a {name}"
        )
    return found


def _of_table_a1(name: str, at: Place) -> t.TypeObject:
    found = BY_PLAIN_NAME.get(plain_name(name))
    if found is None:
        near = get_close_matches(name, ALIASES, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        at.refuse(
            f"{name!r:.80} is no type of table A.1: {hint}Types of your own are read from ArmarX's XML, as "
            f'{{file = "types.xml", name = "example::dto::Cup"}}'
        )
    return found


def _of_file(table: TypeTable, at: Place) -> tuple[t.TypeObject, str]:
    with at.said():
        directories = [(at / "include").path(each) for each in table.include]
        defined = read_definitions((at / "file").path(table.file), include_directories=directories)
    names = ", ".join(sorted(defined)) or "none"
    wanted = table.name.removeprefix("::")
    if not wanted:
        if len(defined) != 1:
            (at / "name").refuse(f"is missing: {table.file} and what it includes define several types ({names:.300})")
        ((wanted, found),) = defined.items()
        return found, wanted
    if wanted not in defined:
        (at / "name").refuse(f"{table.file} defines no {wanted!r:.80}, but {names:.300}")
    return defined[wanted], wanted
