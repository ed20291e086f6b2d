"""Definitions spelled out as plain JSON, so that two are the same exactly when their texts are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from datetime import timedelta
from enum import Enum
from typing import Any

from elm.cues.algebra import Cue
from elm.cues.codec import cue_to_json
from elm.exchange import region_to_json
from elm.geometry import Region

_MICROSECOND = timedelta(microseconds=1)


def plain(value: Any) -> Any:
    """A definition's value as JSON; a function is left out, for a title stands for it."""
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, str | int | float | bool):
        return value
    if isinstance(value, timedelta):
        return {"microseconds": value // _MICROSECOND}
    if isinstance(value, Cue):
        return cue_to_json(value)
    if isinstance(value, Region):
        return region_to_json(value)
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    if is_dataclass(value):
        named = {each.name: plain(getattr(value, each.name)) for each in fields(value) if each.name != "function"}
        return {"is": type(value).__name__, **named}
    raise TypeError(f"a definition cannot hold {value!r:.80}")
