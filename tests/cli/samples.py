"""A small memory for the command line: a hundred and fifty drives, and trips made of them that share parts."""

from __future__ import annotations

import json
from uuid import UUID

from tests.clock import at

TYPES = ('{"type": "Drive", "parents": ["Motion"]}', '{"type": "Motion"}', '{"type": "Trip"}')
DRIVES = 150
HOSTILE = "a\"b'; DROP TABLE event; -- [/red] \x1b[31m \u2028 \u202e ü"
"""Text that is markup, SQL, JSON and a terminal's control sequence to those who take it for that."""


def uid(number: int) -> str:
    return str(UUID(int=number))


def drive(number: int) -> dict[str, object]:
    return {
        "uid": uid(number),
        "type": "Drive",
        "interval": [at(number).isoformat(), at(number + 5).isoformat()],
        "region": {"frame": "map", "polygon": {"type": "Polygon", "coordinates": [square(number, 0)]}},
        "features": [["number", number], ["note", HOSTILE]],
        "agent": "one" if number % 2 else "two",
        "payload": {"media_type": "text/plain", "base64": "aGVsbG8="} if number == 1 else None,
    }


def square(x: float, y: float) -> list[list[float]]:
    return [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]]


def trip(number: int, *parts: int) -> dict[str, object]:
    return {"uid": uid(number), "type": "Trip", "parts": [uid(part) for part in parts]}


EVENTS = (
    *(json.dumps(drive(number)) for number in range(1, DRIVES + 1)),
    json.dumps(trip(1001, 1, 2)),
    json.dumps(trip(1002, 2, 3)),
    json.dumps(trip(1003, 1001, 1002)),
    json.dumps({"uid": uid(1004), "type": "Motion", "interval": [at(0).isoformat(), None]}),
)
