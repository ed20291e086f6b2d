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
from elm.features import canonical
from elm.geometry import Region
from elm.recognizers.durations import micros_of


def plain(value: Any) -> Any:
    """A definition's value as JSON; a function is left out, for a title stands for it."""
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, str | int | float | bool):
        return value
    if isinstance(value, timedelta):
        return {"microseconds": micros_of(value)}
    if isinstance(value, Cue):
        return _sorted_sets(cue_to_json(value))
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


def _sorted_sets(cue: dict[str, Any]) -> dict[str, Any]:
    """A cue's JSON with what is a set in meaning in an order of its own, not that in which it was given."""
    spelled = dict(cue)
    if cue["op"] in ("and", "or"):
        spelled["args"] = [_sorted_sets(arg) for arg in cue["args"]]
    elif cue["op"] == "not":
        spelled["arg"] = _sorted_sets(cue["arg"])
    elif cue["op"] == "features":
        spelled["features"] = sorted(cue["features"], key=lambda pair: canonical((pair[0], pair[1])))
    for name in ("names", "uids"):
        if name in cue:
            spelled[name] = sorted(cue[name])
    return spelled
