"""Dialogues between people and a robot (ARL-SCOUT) as events: what was said, and what annotators made of it later."""

from __future__ import annotations

import re
import tarfile
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path, PurePosixPath
from uuid import NAMESPACE_URL, UUID, uuid5

from elm.demo.recording import ANCHOR
from elm.errors import InvalidValue
from elm.event import Event
from elm.features import Feature
from elm.interval import Interval
from elm.taxonomy import EventType

STREAMS = {
    "CMD": ("Instruction", "commander"),
    "DM->CMD": ("Reply", "dialogue manager"),
    "DM->RN": ("Order", "dialogue manager"),
    "RN": ("Report", "robot navigator"),
}
"""The type of what is said in each stream of a trial, and who says it."""
TYPES = (
    EventType(name="Utterance"),
    *(EventType(name=kind, parents=("Utterance",)) for kind, _ in STREAMS.values()),
    EventType(name="Annotation"),
    EventType(name="Episode"),
)
FIRST_YEAR = 2000
"""Dates before it are those of clocks that were never set."""

_SUFFIX = "_dialogue-structure.txt"
_UNIT = re.compile(r"\d+(-\d+)?")
_NONE = "None"
_NAMESPACE = uuid5(NAMESPACE_URL, "urn:elm:demo:scout")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoutReport:
    """What was read and what is odd in it, counted. In the files' header `rel` and `ant` are swapped."""

    trials: int = 0
    rows: int = 0
    utterances: int = 0
    annotations: int = 0
    """Rows that are annotated at all: with a unit, a mark, an antecedent or a relation."""
    units: int = 0
    marks: int = 0
    """Annotations that put an utterance outside of all units: "X-CMD", "ERR" and odd spellings."""
    wordless: int = 0
    """Rows without a stream; they are left out."""
    tabs: int = 0
    """Rows with a tab within the text."""
    untimed: int = 0
    """Rows without a time: mostly the further parts of one that was split. They have the time of the row before."""
    other_clock: int = 0
    """Rows with a time of another clock than their trial's (bare numbers among dates, dates of the seventies); they
    have the time of the row before."""
    out_of_order: int = 0
    """Rows of an earlier time than the row before."""
    trials_out_of_order: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One trial: each utterance, and the annotations, each at the time of what it is about; both in time order."""

    name: str
    utterances: tuple[Event, ...]
    annotations: tuple[Event, ...]

    @property
    def agent(self) -> str:
        """Whose memory it is: the robot's of this trial."""
        return agent_of(self.name)

    @property
    def in_order(self) -> list[Event]:
        """All events in the order of time, as if the annotators had kept up."""
        return sorted((*self.utterances, *self.annotations), key=_time_order)

    @property
    def as_it_was(self) -> list[Event]:
        """The dialogue first, and then what was made of it."""
        return [*self.utterances, *self.annotations]

    @property
    def end(self) -> datetime:
        """The time of the last utterance."""
        return _at(self.utterances[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    id: str
    time: str
    stream: str
    text: str
    unit: str
    antecedent: str
    relation: str
    has_tab: bool

    @property
    def is_annotated(self) -> bool:
        return any(value != _NONE for value in (self.unit, self.antecedent, self.relation))


def load(archive: Path, trials: Collection[str] | None = None) -> tuple[list[Trial], ScoutReport]:
    """The trials of these names ("p1.04_main1"), by default all, in the archive of tab-delimited files."""
    found: list[Trial] = []
    counts: Counter[str] = Counter()
    for name, text in _texts(archive):
        if trials is None or name in trials:
            found.append(_trial(name, [_row(line) for line in text.splitlines()[1:]], counts))
    if missing := {*(trials or ())} - {trial.name for trial in found}:
        raise InvalidValue(f"{archive.name} has no dialogue structure of trial {min(missing)!r}")
    return found, ScoutReport(trials=len(found), **counts)


def agent_of(trial: str) -> str:
    """The robot of a trial: each has a clock of its own."""
    return f"robot of {trial}"


def _texts(archive: Path) -> Iterator[tuple[str, str]]:
    with tarfile.open(archive) as packed:
        members = {PurePosixPath(member.name).name: member for member in packed.getmembers()}
        for file, member in sorted(members.items()):
            content = packed.extractfile(member) if file.endswith(_SUFFIX) else None
            if content is not None:
                yield file.removesuffix(_SUFFIX), content.read().decode()


def _row(line: str) -> _Row:
    id_, time, stream, *text, unit, antecedent, relation, _ = line.split("\t")
    return _Row(
        id=id_,
        time=time,
        stream=stream,
        text="\t".join(text).strip('"').strip(),
        unit=unit,
        antecedent=antecedent,
        relation=relation,
        has_tab=len(text) > 1,
    )


def _trial(name: str, rows: Sequence[_Row], counts: Counter[str]) -> Trial:
    times = _times(rows, counts)
    base = uuid5(_NAMESPACE, name)
    utterances: list[Event] = []
    annotations: list[Event] = []
    for ordinal, (row, time) in enumerate(zip(rows, times, strict=True)):
        if row.stream not in STREAMS:
            counts["wordless"] += 1
            continue
        kind, speaker = STREAMS[row.stream]
        said: list[Feature] = [("utterance", row.id), ("speaker", speaker), ("text", row.text), ("trial", name)]
        utterances.append(_event(kind, time, said, agent_of(name), _uid(base, 2 * ordinal)))
        if row.is_annotated:
            told = _annotated(row)
            annotations.append(_event("Annotation", time, told, agent_of(name), _uid(base, 2 * ordinal + 1)))
    backwards = sum(later < time for time, later in pairwise(times))
    counts.update(
        rows=len(rows),
        utterances=len(utterances),
        annotations=len(annotations),
        units=len({event.value("unit") for event in annotations} - {None}),
        marks=sum(event.value("mark") is not None for event in annotations),
        tabs=sum(row.has_tab for row in rows),
        out_of_order=backwards,
        trials_out_of_order=bool(backwards),
    )
    return Trial(
        name=name,
        utterances=tuple(sorted(utterances, key=_time_order)),
        annotations=tuple(sorted(annotations, key=_time_order)),
    )


def _annotated(row: _Row) -> list[Feature]:
    given = {"antecedent": row.antecedent, "relation": row.relation}
    given["unit" if _UNIT.fullmatch(row.unit) else "mark"] = row.unit
    return [("utterance", row.id), *((name, value) for name, value in given.items() if value != _NONE)]


def _event(kind: str, time: datetime, features: Sequence[Feature], agent: str, uid: UUID) -> Event:
    return Event(type=kind, interval=Interval.at(time), features=features, agent=agent, uid=uid)


def _uid(base: UUID, ordinal: int) -> UUID:
    """Uids that grow along the file: what was said at one time is fed in the order in which it was written down."""
    return UUID(int=base.int >> 32 << 32 | ordinal)


def _at(event: Event) -> datetime:
    assert event.interval is not None  # noqa: S101 - every event here has one
    return event.interval.begin


def _time_order(event: Event) -> tuple[datetime, UUID]:
    return _at(event), event.uid


# Times: seconds since a trial began, or the date and time of a place that is not told, which is taken for UTC


def _times(rows: Sequence[_Row], counts: Counter[str]) -> list[datetime]:
    """When each row was said: seconds count from `ANCHOR`; what is missing or of another clock is the row's before."""
    known = [None if row.time == _NONE else _moment(row.time) for row in rows]
    clocks = Counter(moment.year for moment in known if moment is not None and _is_set(moment))
    clock = clocks.most_common(1)[0][0]
    own = [moment if moment is not None and moment.year == clock else None for moment in known]
    counts.update(
        untimed=sum(moment is None for moment in known),
        other_clock=sum(moment is not None and moment.year != clock for moment in known),
    )
    latest = next(moment for moment in own if moment is not None)
    return [latest := moment or latest for moment in own]


def _moment(text: str) -> datetime:
    if re.fullmatch(r"\d+(\.\d+)?", text):
        return ANCHOR + timedelta(seconds=float(text))
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


def _is_set(moment: datetime) -> bool:
    return moment.year >= FIRST_YEAR
