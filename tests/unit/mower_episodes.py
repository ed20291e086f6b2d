"""An oracle of the mower's episodes: rows, laps and the session of a whole run, found all at once in its motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from uuid import NAMESPACE_OID, UUID, uuid5

from elm.event import Event
from elm.features import FeatureValue

TURN_BACK = 90.0
"""Degrees from which a turn ends a row."""
SAME_WAY = 30.0
"""Degrees within which two drives head the same way."""
SHORT_DRIVE = 3.0
"""Metres below which a drive does not end a row, whichever way it heads."""
ROW_LENGTH = 5.0
"""Metres of driving that make a row."""

Naming = Callable[[int], UUID]


@dataclass(frozen=True, slots=True, kw_only=True)
class Episodes:
    """All episodes of one run."""

    rows: tuple[Event, ...]
    laps: tuple[Event, ...]
    session: Event


def episodes(motions: Sequence[Event], contacts: Sequence[Event], run: str) -> Episodes:
    """The episodes among a run's motions in time order, and its contacts."""
    found = tuple(rows(motions, lambda number: _uid(run, "row", number)))
    rounds = tuple(laps(motions, found, lambda number: _uid(run, "lap", number)))
    whole = session(motions, contacts, found, rounds, run, _uid(run, "session", 1))
    return Episodes(rows=found, laps=rounds, session=whole)


def _uid(run: str, kind: str, number: int) -> UUID:
    return uuid5(NAMESPACE_OID, f"{run}/{kind}/{number}")


def rows(motions: Sequence[Event], name: Naming) -> Iterator[Event]:
    """The rows among a run's motion events in time order."""
    found = (row for row in _straight_runs(motions) if _driven(row) >= ROW_LENGTH)
    for number, row in enumerate(found, start=1):
        drives = [event for event in row if event.type == "Drive"]
        along = math.fsum(_number(drive, "distance") * math.cos(_heading(drive)) for drive in drives)
        across = math.fsum(_number(drive, "distance") * math.sin(_heading(drive)) for drive in drives)
        features: dict[str, FeatureValue] = {
            "number": number,
            "heading": round(math.degrees(math.atan2(across, along)), 1) % 360,
            "length": round(_driven(row), 3),
            "distance": _length(row),
        }
        yield Event(
            type="Row",
            features=features,
            parts=[event.uid for event in row],
            uid=name(number),
        )


def _straight_runs(motions: Sequence[Event]) -> Iterator[list[Event]]:
    """Drives that head the same way, with what lies between them, and the turns that follow the last one."""
    row: list[Event] = []
    since: list[Event] = []
    """What came after the row's last drive: within the row if another drive of its heading follows."""
    for event in motions:
        if not row:
            row = [event] if event.type == "Drive" else []
        elif event.type == "Drive" and (_turned_back(since) or (_is_long(event) and not _same_way(row[0], event))):
            yield [*row, *takewhile(_is_turn, since)]
            row, since = [event], []
        elif event.type == "Drive" and _same_way(row[0], event):
            row += [*since, event]
            since = []
        else:
            since.append(event)
    if row:
        yield [*row, *takewhile(_is_turn, since)]


def laps(motions: Sequence[Event], found: Sequence[Event], name: Naming) -> Iterator[Event]:
    """The laps among a run's rows, both in time order."""
    at = {event.uid: index for index, event in enumerate(motions)}
    number = 0
    lap: list[Event] = []
    for row in [*found, None]:
        turned = any(not _same_way(lap[0], other) for other in lap)
        back = row is not None and turned and _same_way(lap[0], row)
        if back or (row is None and turned):
            number += 1
            begin = at[lap[0].parts[0]]
            end = at[lap[-1].parts[-1]] + 1 if row is None else at[row.parts[0]]
            yield Event(
                type="Lap",
                features=_lap_features(number, len(lap), motions[begin:end], complete=back),
                parts=_uppermost(motions[begin:end], lap),
                uid=name(number),
            )
            lap = []
        if row is not None:
            lap.append(row)


def _lap_features(number: int, count: int, motions: Sequence[Event], *, complete: bool) -> dict[str, FeatureValue]:
    return {"number": number, "rows": count, "distance": _length(motions), "complete": complete}


def session(
    motions: Sequence[Event],
    contacts: Sequence[Event],
    found: Sequence[Event],
    rounds: Sequence[Event],
    run: str,
    name: UUID,
) -> Event:
    """The whole run: its laps, the motions outside of them, and the beacon contacts."""
    inside = {part for lap in rounds for part in lap.parts}
    loose = [row for row in found if row.uid not in inside]
    held = inside | {part for row in found for part in row.parts}
    features: dict[str, FeatureValue] = {"run": run, "distance": _length(motions)}
    return Event(
        type="Session",
        features=features,
        parts=[
            *(lap.uid for lap in rounds),
            *(row.uid for row in loose),
            *(event.uid for event in motions if event.uid not in held),
            *(contact.uid for contact in contacts),
        ],
        uid=name,
    )


def _uppermost(motions: Sequence[Event], found: Sequence[Event]) -> list[UUID]:
    """The rows and the motions outside of them, in time order."""
    row_of = {part: row.uid for row in found for part in row.parts}
    return list(dict.fromkeys(row_of.get(event.uid, event.uid) for event in motions))


def _is_turn(event: Event) -> bool:
    return event.type == "Turn"


def _is_long(drive: Event) -> bool:
    return _number(drive, "distance") >= SHORT_DRIVE


def _turned_back(motions: Sequence[Event]) -> bool:
    return any(_is_turn(event) and abs(_number(event, "turn")) >= TURN_BACK for event in motions)


def _driven(row: Sequence[Event]) -> float:
    return math.fsum(_number(event, "distance") for event in row if event.type == "Drive")


def _length(motions: Sequence[Event]) -> float:
    return round(math.fsum(_number(event, "distance") for event in motions), 3)


def _same_way(one: Event, other: Event) -> bool:
    apart = abs(_number(one, "heading") - _number(other, "heading")) % 360
    return min(apart, 360 - apart) <= SAME_WAY


def _heading(drive: Event) -> float:
    return math.radians(_number(drive, "heading"))


def _number(event: Event, name: str) -> float:
    value = event.value(name)
    assert isinstance(value, int | float)
    return value
