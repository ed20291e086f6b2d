"""Reads the TOML of a configuration file into its tables, and says where in it something is wrong."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import msgspec

from armem_bridge.config import tables
from armem_bridge.config.refusals import Place, named

_WHERE = re.compile(r"^(.*?)(?: - at `(?:key in )?\$(.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_UNKNOWN = re.compile(r"^Object contains unknown field `(.*)`$", re.DOTALL)
_MISSING = re.compile(r"^Object missing required field `(.*)`$", re.DOTALL)
_KEYS = sorted(
    {
        key
        for table in vars(tables).values()
        if isinstance(table, type) and issubclass(table, tables.Table)
        for key in table.__struct_fields__
    }
)


def read_tables(file: Path) -> tables.FileTable:
    """The tables of a file. Raises `InvalidConfiguration`, naming file and key."""
    try:
        given = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        Place(file).refuse(f"the configuration cannot be read ({error.strerror}): correct its path")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        Place(file).refuse(f"this is no TOML in UTF-8: {error}")
    try:
        return msgspec.convert(given, tables.FileTable)
    except msgspec.ValidationError as error:
        _refuse(file, given, str(error))


def _refuse(file: Path, given: dict[str, Any], message: str) -> NoReturn:
    match = _WHERE.match(message)
    why, path = (match[1], match[2] or "") if match else (message, "")
    place = _place(file, given, path)
    if unknown := _UNKNOWN.match(why):
        near = get_close_matches(unknown[1], _KEYS, n=1)
        hint = f"did you mean {near[0]}?" if near else "leave it out"
        (place / unknown[1]).refuse(f"there is no such key: {hint}")
    if missing := _MISSING.match(why):
        (place / missing[1]).refuse("is missing: add it")
    place.refuse(f"{why[:1].lower()}{why[1:]}".replace("`", ""))


def _place(file: Path, given: Any, path: str) -> Place:
    """The key that msgspec names, with the names of tables in the place of their numbers."""
    place = Place(file)
    kind = ""
    for step in _STEP.finditer(path):
        if step[1] is not None:
            if kind:
                place = place / kind
            kind = step[1]
            given = given.get(kind) if isinstance(given, dict) else None
        elif step[2] == "...":
            # msgspec does not say which value of a mapping it is.
            given = None
        else:
            number = int(step[2])
            given = given[number] if isinstance(given, list) and number < len(given) else None
            name = (given.get("name") or given.get("profile")) if isinstance(given, dict) else None
            place = place / named(kind, str(name) if name else "", number)
            kind = ""
    return place / kind if kind else place
