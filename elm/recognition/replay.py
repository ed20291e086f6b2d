"""Replay (the paper's R*): what recognizers find in the log as it stands, to be committed or compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from uuid import UUID

from elm.cues.algebra import FeaturesCue, Not, TypeCue, UidCue
from elm.cues.relations import SetRelation, TypeRelation
from elm.errors import InvalidValue
from elm.event import Event
from elm.log import LoggedStore
from elm.query import Query
from elm.recognition.clocks import Timing
from elm.recognition.enrolment import check_recognizers, known_strands, refuse_changed
from elm.recognition.fold import Fold, Harvest
from elm.recognition.judging import TypeJudge
from elm.recognition.keeping import keep_results
from elm.recognition.manager import BATCH
from elm.recognition.work import Work
from elm.recognizers.base import DEADLINE, RECOGNIZER, VERSION, Recognizer
from elm.store import Arrival


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """What a replay of the log found.

    `entries` is how many entries of the log it took in. `found` are the uids of all complex events that it found,
    in the order of detection, and `new` those among them that the memory did not have before. `missing` are uids of
    results of these recognizers that the memory has and the replay lacks: found live where late events were not
    known, or by what came before the position it began at. `late` is how many times an event came too late to be
    fed to a strand of recognizers.

    `forgotten` is the position of the first entry whose event has been forgotten, None where there is none: the
    replay ends before it. What it found is that of the log up to there; what it lacks cannot be told, and `missing`
    is empty.
    """

    entries: int
    found: tuple[UUID, ...]
    new: tuple[UUID, ...]
    missing: tuple[UUID, ...]
    late: int
    forgotten: int | None = None


def replay(
    store: LoggedStore,
    recognizers: Sequence[Recognizer],
    *,
    since: int = 0,
    complete: bool = False,
    timing: Timing | None = None,
    commit: bool = True,
) -> Replay:
    """Feed the log behind position `since` to recognizers that have seen nothing, and commit what they find.

    From the beginning, results equal those of a live run with the same `timing`; from a later position they do
    where nothing was unfinished there. A `complete` replay feeds what came too late as well, and holds all events
    that the recognizers want in this process. With `commit=False` nothing is written but the types of the results.

    Where an event of the log was forgotten the replay ends: what follows from it cannot be known.
    """
    check_recognizers(recognizers)
    timing = timing or Timing()
    judge = TypeJudge(store.types)
    strands = known_strands(store, recognizers, timing, judge)
    if commit:
        refuse_changed(store, strands)
    works = [Work(strand, judge) for strand in strands]
    fold = Fold(works, timing, frozenset(each.name for each in recognizers), complete=complete)
    head, position = store.log.head(), since
    if isinstance(since, bool) or not isinstance(since, int) or not 0 <= since <= head:
        raise InvalidValue(f"a replay begins behind a position of the log, 0 to {head:,}, not {since!r}")
    found: list[UUID] = []
    new: list[UUID] = []
    forgotten: int | None = None
    while position < head and forgotten is None:
        entries = store.log.read(position, min(BATCH, head - position))
        forgotten = next((entry.position for entry in entries if entry.is_forgotten), None)
        position = entries[-1].position if forgotten is None else forgotten - 1
        _keep(store, fold.take(entry for entry in entries if entry.position <= position), found, new, commit=commit)
    _keep(store, fold.finish(), found, new, commit=commit)
    known = set(found)
    missing = [uid for uid in _live(store, recognizers) if uid not in known] if forgotten is None else []
    return Replay(
        entries=position - since,
        found=tuple(found),
        new=tuple(new),
        missing=tuple(missing),
        late=sum(work.tally.late for work in works),
        forgotten=forgotten,
    )


def _keep(store: LoggedStore, harvest: Harvest, found: list[UUID], new: list[UUID], *, commit: bool) -> None:
    if harvest.failures:
        _, failure = harvest.failures[0]
        raise InvalidValue(f"the replay ended, for a recognizer failed: {failure}") from failure.__cause__
    wholes = [result.events[-1] for _, result in harvest.results]
    found += [each.uid for each in wholes]
    if not commit:
        absent = [each.uid for each in wholes if not store.exists(UidCue(uids=(each.uid,)))]
        forgotten = {each.uid for each in store.tombstones(absent)}
        new += [uid for uid in absent if uid not in forgotten]
        return
    events: list[Event] = [event for _, result in harvest.results for event in result.events]
    kept = keep_results(store, [Arrival(event=event) for event in events], store.commit_all)
    fresh = {each.uid for each in kept if each.new}
    new += [each.uid for each in wholes if each.uid in fresh]


def _live(store: LoggedStore, recognizers: Sequence[Recognizer]) -> Iterator[UUID]:
    """The results of these recognizers that the memory has."""
    for recognizer in recognizers:
        marks = ((RECOGNIZER, recognizer.name), (VERSION, recognizer.version))
        of_it = FeaturesCue(relation=SetRelation.SUPERSET, features=marks)
        no_deadline = Not(arg=TypeCue(relation=TypeRelation.EXACTLY, type=DEADLINE.name))
        has_deadlines = any(output.name == DEADLINE.name for output in recognizer.outputs)
        cue = of_it & no_deadline if has_deadlines else of_it
        for event in store.find(Query(cue=cue)):
            yield event.uid
