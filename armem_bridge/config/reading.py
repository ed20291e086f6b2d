"""Reads the TOML of a configuration file into its tables, and says where in it something is wrong."""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from enum import EnumType
from pathlib import Path
from typing import Any, NoReturn, get_args

import msgspec

from armem_bridge.config import tables
from armem_bridge.config.refusals import Place, named

_WHERE = re.compile(r"^(.*?)(?: - at `(?:key in )?\$(.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.(\w+)|\[(\d+|\.\.\.)\]")
_UNKNOWN = re.compile(r"^Object contains unknown field `(.*)`$", re.DOTALL)
_MISSING = re.compile(r"^Object missing required field `(.*)`$", re.DOTALL)
_EXPECTED = re.compile(r"^Expected `(.*)`, got `(.*)`$", re.DOTALL)
_NO_CHOICE = re.compile(r"^Invalid enum value (.*)$", re.DOTALL)
_TABLES = [table for table in vars(tables).values() if isinstance(table, type) and issubclass(table, tables.Table)]
_KEYS = sorted({key for table in _TABLES for key in table.__struct_fields__})
_KINDS = {
    "int": "an integer",
    "float": "a number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}
"""What msgspec calls the values of TOML, and what to call them."""


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
        (place / unknown[1]).refuse(_no_such_key(unknown[1]))
    if missing := _MISSING.match(why):
        (place / missing[1]).refuse("is missing: add it")
    if expected := _EXPECTED.match(why):
        kinds = " or ".join(_KINDS.get(kind, kind) for kind in expected[1].split(" | ") if kind != "null")
        place.refuse(f"is {kinds}, not {_KINDS.get(expected[2], expected[2])}: correct it")
    if no_choice := _NO_CHOICE.match(why):
        place.refuse(f"is one of {', '.join(_choices(place.key.rpartition('.')[2]))}, not {no_choice[1]}")
    place.refuse(f"{why[:1].lower()}{why[1:]}".replace("`", ""))


def _no_such_key(key: str) -> str:
    if key in _KEYS:
        homes = [found[1] for table in _TABLES if key in table.__struct_fields__ and (found := _home(table))]
        return f"there is no such key here: it is one of {' or of '.join(homes)}"
    near = get_close_matches(key, _KEYS, n=1)
    return f"there is no such key: did you mean {near[0]}?" if near else "there is no such key: leave it out"


def _home(table: type) -> re.Match[str] | None:
    """How the file writes a table, as the first words in backticks of its description."""
    return re.search(r"`([^`]*)`", table.__doc__ or "")


def _choices(key: str) -> list[str]:
    """The texts that a key may be, in whichever table it is."""
    kinds = [field.type for table in _TABLES for field in msgspec.structs.fields(table) if field.name == key]
    return [str(choice) for kind in kinds[:1] for choice in (kind if isinstance(kind, EnumType) else get_args(kind))]


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
