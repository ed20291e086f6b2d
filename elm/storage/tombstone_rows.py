"""The tombstones of a memory in the database: reading them, and keeping those of another memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any
from uuid import UUID

from elm.geometry import Region
from elm.interval import Interval
from elm.storage import forgetting_statements as sql
from elm.storage.batch_forgetting import admit_tombstones, admits_tombstones
from elm.storage.connections import Connection
from elm.storage.rows import moment
from elm.storage.tables import HULL_OF_REGIONS, HULL_OF_SUBJECTS
from elm.store import BatchReport, ForgettingCount, Refusal
from elm.tombstone import RunTombstone, Tombstone, other_tombstone

FrameName = Callable[[int], str]
"""Gives a frame's name by its number."""

_AT_ONCE = 1_000


def forgotten_among(connection: Connection, uids: Sequence[UUID]) -> set[UUID]:
    """Which of these are uids of tombstones."""
    found = connection.execute(sql.FORGOTTEN_AMONG, {"uids": list(uids)}, binary=True)
    return {UUID(bytes=uid) for (uid,) in found}


def tombstones(connection: Connection, uids: Sequence[UUID] | None, frame: FrameName) -> Iterator[Tombstone]:
    """All tombstones by id, or those of some uids."""
    if uids is None:
        rows = connection.cursor().stream(sql.TOMBSTONES, binary=True)
    else:
        rows = iter(connection.execute(sql.TOMBSTONES_OF, {"uids": list(uids)}, binary=True).fetchall())
    for number, uid, begin, end, frame_id, region, subject_frame_id, subject, agent, run in rows:
        yield Tombstone(
            id=number,
            uid=UUID(bytes=uid),
            interval=Interval(begin=moment(begin), end=moment(end)),
            region=None if frame_id is None else Region.from_wkb(region, frame=frame(frame_id)),
            subject=None if subject_frame_id is None else Region.from_wkb(subject, frame=frame(subject_frame_id)),
            agent=agent,
            run=UUID(bytes=run),
        )


def count(connection: Connection) -> ForgettingCount:
    """How many runs of forgetting there were, and of how many events they tell."""
    ((runs, events),) = connection.execute(sql.COUNT_RUNS).fetchall()
    return ForgettingCount(runs=runs, events=events)


def run_tombstones(
    connection: Connection, frame: FrameName, names: Sequence[UUID] | None = None
) -> Iterator[RunTombstone]:
    """What is left of the rest of each forgetting, oldest first; with `names` of these runs, in any order."""
    if names is None:
        runs = connection.execute(sql.RUNS, binary=True).fetchall()
    else:
        runs = connection.execute(sql.RUNS_OF, {"runs": list(names)}, binary=True).fetchall()
    for start in range(0, len(runs), _AT_ONCE):
        some = runs[start : start + _AT_ONCE]
        hulls: dict[tuple[bytes, int], list[Region]] = {}
        asked = {"runs": [UUID(bytes=row[0]) for row in some]}
        for run, kind, frame_id, hull in connection.execute(sql.PLACES, asked, binary=True):
            hulls.setdefault((run, kind), []).append(Region.from_wkb(hull, frame=frame(frame_id)))
        for run, at, events, begin, end in some:
            yield RunTombstone(
                run=UUID(bytes=run),
                at=moment(at),
                events=events,
                interval=None if begin is None else Interval(begin=moment(begin), end=moment(end)),
                regions=tuple(hulls.get((run, HULL_OF_REGIONS), ())),
                subjects=tuple(hulls.get((run, HULL_OF_SUBJECTS), ())),
            )


def keep(
    connection: Connection,
    given: Sequence[Tombstone | RunTombstone],
    frame: FrameName,
    frame_ids: Callable[[str], int],
) -> BatchReport:
    """Keep tombstones of another memory, in one transaction."""
    if not admits_tombstones(connection):
        admit_tombstones(connection)
    with connection.transaction():
        connection.execute(sql.TAKE_TURNS)
        singles = [each for each in given if isinstance(each, Tombstone)]
        uids = [each.uid for each in singles]
        present = {UUID(bytes=uid) for (uid,) in connection.execute(sql.EVENTS_AMONG, {"uids": uids}, binary=True)}
        known: dict[UUID, Tombstone | RunTombstone] = {each.uid: each for each in tombstones(connection, uids, frame)}
        if runs := [each.run for each in given if isinstance(each, RunTombstone)]:
            known |= {each.run: each for each in run_tombstones(connection, frame, runs)}
        new = existing = 0
        refused: list[Refusal] = []
        for index, each in enumerate(given):
            name = each.uid if isinstance(each, Tombstone) else each.run
            if name in present:
                existing += 1
            elif name not in known:
                _insert(connection, each, frame_ids)
                known[name] = each
                new += 1
            elif known[name] == each:
                existing += 1
            else:
                refused.append(Refusal(index=index, reason=other_tombstone(each)))
    return BatchReport(new=new, existing=existing, refused=tuple(refused))


def _insert(connection: Connection, given: Tombstone | RunTombstone, frame_id: Callable[[str], int]) -> None:
    values: dict[str, Any] = {
        "run": given.run,
        "begin": None if given.interval is None else given.interval.begin,
        "end": None if given.interval is None else given.interval.end,
    }
    if isinstance(given, Tombstone):
        values |= {"uid": given.uid, "agent": given.agent}
        for name, frame, place in (("region", "frame", given.region), ("subject", "subject_frame", given.subject)):
            values |= {name: place and place.wkb, frame: place and frame_id(place.frame)}
        connection.execute(sql.KEEP_TOMBSTONE, values)
        return
    connection.execute(sql.KEEP_RUN, {**values, "at": given.at, "events": given.events})
    for kind, places in ((HULL_OF_REGIONS, given.regions), (HULL_OF_SUBJECTS, given.subjects)):
        for place in places:
            hull = {"run": given.run, "kind": kind, "frame": frame_id(place.frame), "hull": place.wkb}
            connection.execute(sql.KEEP_PLACE, hull)
