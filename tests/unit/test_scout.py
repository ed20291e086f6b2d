"""Tests of the dialogues with a robot: counts of the files, units of dialogue, and annotations that come too late."""

from __future__ import annotations

import io
import os
import tarfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path

import pytest

from elm import cues
from elm.app import Memory
from elm.demo import scout, scout_recognizers
from elm.demo.recording import ANCHOR
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.interval import Interval
from elm.recognition import Timing
from elm.recognition.status import RecognizerStatus
from elm.storage.memory import MemoryStore

LATENESS = timedelta(minutes=5)
TIMING = Timing(lateness=LATENESS)
NAMES = ("p1.04_main1", "p1.08_train", "p2.05_main2", "p3.31_main1", "p3.56_main1", "p4.02_main2")
"""Trials on both clocks: seconds and dates; the last with most of its times from a clock that was never set."""


@pytest.fixture(scope="module")
def archive() -> Path:
    if not (given := os.environ.get("ELM_TEST_DATA")):
        pytest.skip("ELM_TEST_DATA is not set: the dialogues are not here")
    found = Path(given) / "scout" / "scout_tab.tar.gz"
    if not found.is_file():
        pytest.skip(f"ELM_TEST_DATA has no file scout/scout_tab.tar.gz: {given}")
    return found


@pytest.fixture(scope="module")
def everything(archive: Path) -> tuple[list[scout.Trial], scout.ScoutReport]:
    return scout.load(archive)


@pytest.fixture(scope="module")
def trials(everything: tuple[list[scout.Trial], scout.ScoutReport]) -> list[scout.Trial]:
    return [trial for trial in everything[0] if trial.name in NAMES]


@pytest.fixture(scope="module")
def lines(archive: Path) -> dict[str, list[list[str]]]:
    """The trials' lines as they are in the archive."""
    found = {}
    with tarfile.open(archive) as packed:
        for name in NAMES:
            member = packed.extractfile(f"dialogue-structure/tab-delimited/{name}_dialogue-structure.txt")
            assert member is not None
            found[name] = [line.split("\t") for line in member.read().decode().splitlines()[1:]]
    return found


# The files


def test_the_files_and_their_oddities_are_counted(
    everything: tuple[list[scout.Trial], scout.ScoutReport],
) -> None:
    trials, report = everything
    assert report == scout.ScoutReport(
        trials=278,
        rows=88_778,
        utterances=88_772,
        annotations=87_042,
        units=13_110,
        marks=4_705,
        wordless=6,
        tabs=4,
        untimed=480,
        other_clock=508,
        out_of_order=1_800,
        trials_out_of_order=36,
    )
    assert sum(len(trial.utterances) for trial in trials) == report.utterances
    assert sum(len(trial.annotations) for trial in trials) == report.annotations
    assert all(trial.utterances for trial in trials)


def test_what_was_said_is_told_by_whom_and_when(trials: list[scout.Trial], lines: dict[str, list[list[str]]]) -> None:
    for trial in trials[:3]:
        said = {event.value("utterance"): event for event in trial.utterances}
        begin = None
        for id_, time, stream, text, *_ in lines[trial.name]:
            event = said[id_]
            assert (event.type, event.value("speaker")) == scout.STREAMS[stream]
            assert event.value("text") == text.strip('"').strip()
            assert event.agent == f"robot of {trial.name}"
            begin = ANCHOR + timedelta(seconds=float(time)) if time != "None" else begin
            assert event.interval == Interval.at(begin or ANCHOR)


def test_annotations_say_what_the_swapped_columns_mean(
    trials: list[scout.Trial], lines: dict[str, list[list[str]]]
) -> None:
    """The header says `rel ant`, and the antecedent stands first."""
    for trial in trials:
        at = {event.value("utterance"): event.interval for event in trial.utterances}
        told = {event.value("utterance"): event for event in trial.annotations}
        for id_, _, _, _, unit, antecedent, relation, _ in lines[trial.name]:
            given = {"antecedent": antecedent, "relation": relation, "unit": unit}
            if set(given.values()) == {"None"}:
                assert id_ not in told
                continue
            note = told[id_]
            assert note.interval == at[id_]
            for name, value in given.items():
                is_known = value != "None" and value not in ("X-CMD", "ERR")
                assert note.value(name) == (value if is_known else None)
            assert note.value("mark") == (unit if unit in ("X-CMD", "ERR") else None)
    relations = {event.value("relation") for trial in trials for event in trial.annotations}
    assert {"ack-done", "translation-l", "translation-r-direct", "req-clar"} <= relations


def test_times_of_other_clocks_are_those_of_the_row_before(trials: list[scout.Trial]) -> None:
    years = {trial.name: {_at(event).year for event in trial.utterances} for trial in trials}
    assert years["p1.04_main1"] == {2000}
    assert years["p3.56_main1"] == {2018}
    assert years["p4.02_main2"] == {2019}
    # Its order is that of the file for all that: an order and the reply to it at the time of the instruction.
    first = [str(event.value("text")) for trial in trials if trial.name == "p4.02_main2" for event in trial.utterances]
    assert first[4:8] == ["I am also ready", "participant is ready", "Processing....", "I'm also ready. <beep>"]


def test_odd_lines_are_read_and_counted(tmp_path: Path) -> None:
    head = "id\ttime\tstream\ttext\ttu\trel\tant\tcontext"
    rows = [
        '1\tNone\tRN\t"ready"\t1\tNone\tNone\tNone',
        '2\t4.5\tCMD\t"a\ttab"\t26-1\tNone\tNone\tNone',
        '3A\t3.5\tDM->RN\t"back"\t-2\t2*\tcontinue\tNone',
        '3B\tNone\tDM->RN\t"and on"\tNone\tNone\tNone\tNone',
        '4\t1970-01-01 00:00:07.5\tRN\t"done"\tX-CMD\tNone\tNone\tNone',
        '5\t6\tNone\t"None"\tNone\tNone\tNone\tNone',
    ]
    content = "\n".join([head, *rows]).encode()
    packed = tmp_path / "odd.tar.gz"
    with tarfile.open(packed, "w:gz") as writing:
        member = tarfile.TarInfo("any/p9.01_main1_dialogue-structure.txt")
        member.size = len(content)
        writing.addfile(member, io.BytesIO(content))
    (trial,), report = scout.load(packed)
    assert report == scout.ScoutReport(
        trials=1,
        rows=6,
        utterances=5,
        annotations=4,
        units=2,
        marks=2,
        wordless=1,
        tabs=1,
        untimed=2,
        other_clock=1,
        out_of_order=1,
        trials_out_of_order=1,
    )
    said = [((_at(e) - ANCHOR).total_seconds(), e.value("utterance")) for e in trial.utterances]
    assert said == [(3.5, "3A"), (3.5, "3B"), (3.5, "4"), (4.5, "1"), (4.5, "2")]
    assert trial.utterances[-1].value("text") == "a\ttab"
    with pytest.raises(InvalidValue, match=r"odd\.tar\.gz has no dialogue structure of trial 'p9\.02_main1'"):
        scout.load(packed, ["p9.02_main1"])


# Units of dialogue


def _at(event: Event) -> datetime:
    assert event.interval is not None
    return event.interval.begin


def _memory(name: str) -> Memory:
    memory = Memory(MemoryStore(memory=name))
    memory.add_types(scout.TYPES)
    return memory


def _end(memory: Memory, trials: Iterable[scout.Trial]) -> None:
    """Each trial is over: nothing more is to come, but what comes too late."""
    for trial in trials:
        memory.punctuate(trial.end + scout_recognizers.PAUSE + timedelta(seconds=1), agent=trial.agent)


def _recognized(memory: Memory) -> list[RecognizerStatus]:
    manager = memory.recognition(scout_recognizers.RECOGNIZERS, timing=TIMING)
    manager.catch_up()
    return manager.status()


@pytest.fixture(scope="module")
def in_order(trials: list[scout.Trial]) -> Iterator[Memory]:
    """Recognized live from a log in which each annotation comes with its utterance."""
    with _memory("in-order") as memory:
        memory.load(event for trial in trials for event in trial.in_order)
        _end(memory, trials)
        assert [(each.late, each.dropped, each.is_failing) for each in _recognized(memory)] == [(0, 0, False)] * 2
        yield memory


def _units(memory: Memory) -> list[StoredEvent]:
    return list(memory.recall(cues.exactly("TransactionUnit")))


def _said(memory: Memory, unit: StoredEvent) -> list[str]:
    """The ids of the utterances of a unit, in the order in which they matched."""
    pairs = [memory.get(part) for part in unit.parts]
    utterances = [memory.get(pair.parts[0]) for pair in pairs]
    notes = [memory.get(pair.parts[1]) for pair in pairs]
    assert all("Annotation" not in each.type for each in utterances)
    assert {each.value("unit") for each in notes} == {unit.value("unit")}
    return [str(each.value("utterance")) for each in utterances]


def test_units_are_those_of_the_annotation(
    in_order: Memory, trials: list[scout.Trial], lines: dict[str, list[list[str]]]
) -> None:
    """All utterances that a column of the file gives to one unit, in the order of their times."""
    found: dict[str | None, dict[object, list[str]]] = defaultdict(dict)
    for unit in _units(in_order):
        assert unit.value("unit") not in found[unit.agent]
        found[unit.agent][unit.value("unit")] = _said(in_order, unit)
        assert unit.value("utterances") == len(unit.parts)
    total = 0
    for trial in trials:
        at = {str(event.value("utterance")): (_at(event), event.uid) for event in trial.utterances}
        expected: dict[object, list[str]] = defaultdict(list)
        for id_, _, _, _, unit_name, *_ in lines[trial.name]:
            if unit_name not in ("None", "X-CMD", "ERR"):
                expected[unit_name].append(id_)
        assert found[trial.agent] == {name: sorted(ids, key=at.__getitem__) for name, ids in expected.items()}
        total += len(expected)
    assert len(_units(in_order)) == total > 250


def test_units_overlap(in_order: Memory) -> None:
    """The next instruction comes before the last one is carried out."""
    by_agent: dict[str | None, list[Interval]] = defaultdict(list)
    for unit in _units(in_order):
        by_agent[unit.agent].append(unit.interval)
    pairs = [pair for intervals in by_agent.values() for pair in pairwise(intervals)]
    assert sum(one.end is not None and one.end > other.begin for one, other in pairs) > 20


def test_annotations_come_late_and_a_complete_replay_knows_them(in_order: Memory, trials: list[scout.Trial]) -> None:
    with _memory("as-it-was") as memory:
        memory.load(event for trial in trials for event in trial.as_it_was)
        _end(memory, trials)
        status = _recognized(memory)

        # Live: what is annotated within the lateness counts, all else is told as late, and kept for all that.
        late = {
            event.uid
            for trial in trials
            for event in trial.annotations
            if _at(event) < _at(trial.utterances[-1]) - LATENESS
        }
        all_notes = sum(len(trial.annotations) for trial in trials)
        assert 0 < len(late) < all_notes
        assert {each.late for each in status} == {len(late)}
        assert memory.recall(cues.exactly("Annotation")).count() == all_notes
        live = {event.uid: event for event in _units(memory)}
        complete = {event.uid: event for event in _units(in_order)}
        assert 0 < len(live) < len(complete)
        known = [note for event in memory.recall(cues.exactly("AnnotatedUtterance")) for note in event.parts]
        assert not late & {*known}

        # A replay of the same log finds the same, and knows no more.
        again = memory.recognize(scout_recognizers.RECOGNIZERS, timing=TIMING)
        assert (again.new, again.missing, again.late) == ((), (), len(late))

        # A complete one finds what a log in order gives.
        told = memory.recognize(scout_recognizers.RECOGNIZERS, timing=TIMING, complete=True)
        units = {event.uid: event for event in _units(memory)}
        assert complete.keys() == {uid for uid in told.found if memory.get(uid).type == "TransactionUnit"}
        for uid, unit in complete.items():
            assert (units[uid].parts, units[uid].interval) == (unit.parts, unit.interval)
            assert units[uid].features == unit.features
        pairs = memory.recall(cues.exactly("AnnotatedUtterance"))
        assert {event.uid for event in pairs} == {
            event.uid for event in in_order.recall(cues.exactly("AnnotatedUtterance"))
        }

        # Units of which only the end was known in time stay as they were found, and are told.
        assert set(told.missing) == live.keys() - complete.keys()
        assert all(
            live[uid].value("unit") in {each.value("unit") for each in complete.values()} for uid in told.missing
        )
        assert len(told.missing) > 0
        third = memory.recognize(scout_recognizers.RECOGNIZERS, timing=TIMING, complete=True)
        assert (third.new, third.missing) == ((), told.missing)
