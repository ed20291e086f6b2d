"""What the mower's episodes are recognized by: rows, laps, sessions and visits to beacons, as the glossary has them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from datetime import timedelta
from itertools import takewhile
from typing import ClassVar

from elm import cues
from elm.app import Memory
from elm.demo.by_run import PAUSE, Run, RunProcess, RunRecognizer
from elm.demo.plaza import AGENT, PlazaRun, beacon_places
from elm.demo.recording import RUNS
from elm.demo.words import number
from elm.event import StoredEvent
from elm.recognition.status import RecognizerStatus
from elm.recognizers import Emission, Fed, Recognizer, Stay, count, sum_of

TURN_BACK = 90.0
"""Degrees from which a turn ends a row."""
SAME_WAY = 30.0
"""Degrees within which two drives head the same way."""
SHORT_DRIVE = 3.0
"""Metres below which a drive does not end a row, whichever way it heads."""
ROW_LENGTH = 5.0
"""Metres of driving that make a row."""
NEAR_BEACON = 8.0
"""Metres from a beacon within which a motion is near it."""
VISIT = timedelta(seconds=10)
"""Less time near a beacon is a passage."""
CONSUMER = "demo"
_MICROSECOND = timedelta(microseconds=1)


class Rows(RunProcess):
    """Straight passes over the plaza, each with the turns at its end.

    Held are the row so far, up to its last drive, and what came since: within the row if another drive of its
    heading follows.
    """

    NUMBERS: ClassVar = {
        "turn_back": TURN_BACK,
        "same_way": SAME_WAY,
        "short_drive": SHORT_DRIVE,
        "row_length": ROW_LENGTH,
    }

    def _take(self, run: Run, fed: Fed) -> Iterable[Emission]:
        row, since = run.held["row"], run.held["since"]
        found: Sequence[Emission] = ()
        match fed.event.type:
            case "Drive" if row and _breaks_off(row[0].event, since, fed.event):
                found = self._over(run)
                run.held["row"], run.held["since"] = [fed], []
            case "Drive" if not row or _same_way(row[0].event, fed.event):
                row += [*since, fed]
                since.clear()
            case "Drive" | "Turn" | "Stand" if row:
                since.append(fed)
        return found

    def _over(self, run: Run) -> Sequence[Emission]:
        ended = takewhile(lambda fed: fed.event.type == "Turn", run.held["since"])
        events = [fed.event for fed in (*run.held["row"], *ended)]
        drives = [event for event in events if event.type == "Drive"]
        length = math.fsum(number(drive, "distance") for drive in drives)
        if length < ROW_LENGTH:
            return ()
        run.found += 1
        along = math.fsum(number(drive, "distance") * math.cos(_radians(drive)) for drive in drives)
        across = math.fsum(number(drive, "distance") * math.sin(_radians(drive)) for drive in drives)
        features = (
            ("number", run.found),
            ("heading", round(math.degrees(math.atan2(across, along)), 1) % 360),
            ("length", round(length, 3)),
            ("distance", _distance(events)),
        )
        return (Emission(type="Row", parts=_parts(events), features=features),)


class Laps(RunProcess):
    """Once around the plaza, or up and back: rows until one heads the first one's way again.

    Held are the rows of the lap under way, and the motions since it began that are in none of them.
    """

    NUMBERS: ClassVar = {"same_way": SAME_WAY}

    def _take(self, run: Run, fed: Fed) -> Iterable[Emission]:
        if fed.event.type == "BeaconContact":
            return
        if fed.event.type != "Row":
            run.held["motions"].append(fed)
            return
        rows = run.held["rows"]
        run.held["motions"] = _without(run.held["motions"], fed.event)
        if _has_turned(rows) and _same_way(rows[0].event, fed.event):
            yield _lap(run, until=fed.begin, complete=True)
            rows.clear()
        if not rows:
            run.held["motions"] = [motion for motion in run.held["motions"] if motion.begin > fed.begin]
        rows.append(fed)

    def _over(self, run: Run) -> Sequence[Emission]:
        rows = run.held["rows"]
        return (_lap(run, until=rows[-1].begin, complete=False),) if _has_turned(rows) else ()


class Sessions(RunProcess):
    """Whole runs. Held are their direct parts: laps, what is in no lap or row, and the contacts."""

    def _take(self, run: Run, fed: Fed) -> Iterable[Emission]:
        role = {"Lap": "laps", "Row": "rows", "BeaconContact": "contacts"}.get(fed.event.type, "motions")
        if fed.event.is_complex:
            for inside in ("rows", "motions"):
                run.held[inside] = _without(run.held[inside], fed.event)
        run.held[role].append(fed)
        return ()

    def _over(self, run: Run) -> Sequence[Emission]:
        # Contacts are fed as they end, and told as they began.
        heard = sorted(run.held["contacts"], key=lambda fed: fed.begin)
        held = [*run.held["laps"], *run.held["rows"], *run.held["motions"], *heard]
        events = [fed.event for fed in held]
        frame = next(event.region.frame for event in events if event.region is not None)
        features = (("run", frame), ("distance", _distance(events)))
        return (Emission(type="Session", parts=_parts(events), features=features),)


def _lap(run: Run, *, until: int, complete: bool) -> Emission:
    """The lap of the rows that are held, with the motions that begin before `until`."""
    rows = run.held["rows"]
    between = [motion for motion in run.held["motions"] if motion.begin < until]
    events = [fed.event for fed in sorted([*rows, *between], key=lambda fed: fed.begin)]
    run.found += 1
    features = (("number", run.found), ("rows", len(rows)), ("distance", _distance(events)), ("complete", complete))
    return Emission(type="Lap", parts=_parts(events), features=features)


def _parts(events: Iterable[StoredEvent]) -> tuple[tuple[str, StoredEvent], ...]:
    return tuple((event.type, event) for event in events)


def _without(held: Iterable[Fed], whole: StoredEvent) -> list[Fed]:
    """What is no direct part of a whole."""
    return [fed for fed in held if fed.event.uid not in whole.parts]


def _distance(events: Iterable[StoredEvent]) -> float:
    return round(math.fsum(number(event, "distance") for event in events), 3)


def _breaks_off(first: StoredEvent, since: Sequence[Fed], drive: StoredEvent) -> bool:
    """Whether a drive is none of the row that `first` began: it comes after a turn back, or is long and heads off."""
    turned_back = any(fed.event.type == "Turn" and abs(number(fed.event, "turn")) >= TURN_BACK for fed in since)
    return turned_back or (number(drive, "distance") >= SHORT_DRIVE and not _same_way(first, drive))


def _has_turned(rows: Sequence[Fed]) -> bool:
    return any(not _same_way(rows[0].event, row.event) for row in rows)


def _same_way(one: StoredEvent, other: StoredEvent) -> bool:
    apart = abs(number(one, "heading") - number(other, "heading")) % 360
    return min(apart, 360 - apart) <= SAME_WAY


def _radians(drive: StoredEvent) -> float:
    return math.radians(number(drive, "heading"))


_ATOMIC = cues.is_a("Motion") | cues.exactly("BeaconContact")

ROWS = RunRecognizer(name="mower-rows", type="Row", interest=_ATOMIC, process=Rows)
LAPS = RunRecognizer(name="mower-laps", type="Lap", interest=_ATOMIC | cues.exactly("Row"), process=Laps)
SESSIONS = RunRecognizer(
    name="mower-sessions",
    type="Session",
    interest=_ATOMIC | cues.exactly("Row") | cues.exactly("Lap"),
    process=Sessions,
)
VISITS = Stay(
    name="beacon-visits",
    version=1,
    type="BeaconVisit",
    parents=["Episode"],
    passage="BeaconPassage",
    cue=cues.is_a("Motion"),
    places={f"beacon {beacon} of {run}": place for run in RUNS for beacon, place in beacon_places(run).items()},
    relation="within_distance",
    distance=NEAR_BEACON,
    least=VISIT,
    gap=PAUSE,
    measures={"motions": count(), "distance": sum_of("distance")},
)
RECOGNIZERS: tuple[Recognizer, ...] = (ROWS, LAPS, SESSIONS, VISITS)


def recognize(memory: Memory, runs: Iterable[PlazaRun]) -> list[RecognizerStatus]:
    """Find the episodes of runs that were loaded; again finds nothing new."""
    manager = memory.recognition(RECOGNIZERS, consumer=CONSUMER)
    manager.catch_up()
    for run in runs:
        if not memory.recall(cues.exactly("Session") & cues.feature("run", "=", run.name)).exists():
            # A recording that is over can promise what a robot cannot: nothing more is to come.
            memory.punctuate(run.end + PAUSE + _MICROSECOND, agent=AGENT)
            manager.catch_up()
    return manager.status()
