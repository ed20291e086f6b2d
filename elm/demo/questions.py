"""What a person would ask the mower's memory: each question with its cue and the way its answer is said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from statistics import median

from elm import cues
from elm.app import Memory
from elm.cues.algebra import Cue
from elm.demo.mower_recognizers import NEAR_BEACON, VISIT
from elm.demo.plaza import beacon_places
from elm.demo.recording import RUNS
from elm.demo.words import at, clock, doing, duration, lasted, listed, named, number, numbers, run_of
from elm.event import StoredEvent
from elm.geometry import Region
from elm.query import ByFeature, Nearest
from elm.recollector import OrderName, Recollection

MIDDLE = Region.around(-20.0, 25.0, 0.1, frame="plaza1")
"""A point in the middle of the first plaza."""
NORTH_END = Region.box(-30.0, 48.0, -5.0, 60.0, frame="plaza1")
"""The tip of the first plaza, where the mowing ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A question in words, the cue it comes to, in which order it is asked, and how to say the answer."""

    text: str
    cue: Callable[[Memory], Cue]
    say: Callable[[Memory, Recollection], list[str]]
    order: OrderName = "begin"
    limit: int | None = None

    def recall(self, memory: Memory) -> Recollection:
        """What the question recalls from `memory`."""
        return memory.recall(self.cue(memory), order=self.order, limit=self.limit)

    def answer(self, memory: Memory) -> list[str]:
        """The answer, line by line."""
        return self.say(memory, self.recall(memory))


# Cues


def _beacon(beacon: int) -> list[Region]:
    return [beacon_places(run)[beacon] for run in RUNS]


def _near(beacon: int, metres: float) -> Cue:
    return cues.any_of(*(cues.within(metres, place) for place in _beacon(beacon)))


def session_of(memory: Memory, run: str) -> StoredEvent:
    """The session of the run of this name."""
    (session,) = memory.recall(cues.exactly("Session") & cues.feature("run", "=", run))
    return session


def _stands(memory: Memory) -> list[StoredEvent]:
    return list(memory.recall(cues.exactly("Stand")))


def _contacts_at_stands(memory: Memory) -> Cue:
    overlaps = cues.any_of(*(cues.time("intersects", stand.interval) for stand in _stands(memory)))
    return cues.exactly("BeaconContact") & overlaps


def _after_longest_stand(memory: Memory) -> Cue:
    return cues.is_a("Motion") & cues.time("met_by", max(_stands(memory), key=duration).interval)


def _laps_with_stands(memory: Memory) -> Cue:
    stands = [stand.uid for stand in _stands(memory)]
    return cues.exactly("Lap") & cues.parts("intersects", stands, transitive=True)


def _laps_with_visits(memory: Memory) -> Cue:
    visits = memory.recall(cues.exactly("BeaconVisit"))
    near = {part for visit in visits for part in visit.parts}
    return cues.exactly("Lap") & cues.parts("intersects", near, transitive=True)


def _minute_ten(memory: Memory) -> Cue:
    begin = session_of(memory, "plaza1").interval.begin + timedelta(minutes=9)
    return cues.is_a("Motion") & cues.time("intersects", begin, begin + timedelta(minutes=1))


def _far_from_beacons(memory: Memory) -> Cue:
    near = cues.any_of(*(cues.within(28.0, place) for place in beacon_places("plaza1").values()))
    # Not near any beacon is also true of every event in another frame: the session keeps to this one.
    return cues.is_a("Motion") & cues.time("subset", session_of(memory, "plaza1").interval) & ~near


def _out_of_touch(memory: Memory) -> Cue:
    contacts = memory.recall(cues.exactly("BeaconContact"))
    in_touch = cues.any_of(*(cues.time("intersects", contact.interval) for contact in contacts))
    return cues.is_a("Motion") & ~in_touch


# Answers


def _distance(event: StoredEvent, beacon: int) -> float:
    assert event.region is not None  # noqa: S101 - asked of events that a region cue found
    return min(d for place in _beacon(beacon) if (d := place.distance(event.region)) is not None)


def _say_near_rows(memory: Memory, found: Recollection) -> list[str]:
    rows = list(found)
    nearest = min(rows, key=lambda row: _distance(row, 6))
    begin = clock(nearest.interval.begin)
    return [*numbers(rows), f"nearest: {named(nearest)}, begun at {begin}, {_distance(nearest, 6):.1f} m away"]


def _say_last_near(memory: Memory, found: Recollection) -> list[str]:
    (last,) = found
    wholes = memory.recall(cues.parts("superset", [last.uid], transitive=True), order="id")
    inside = ", in ".join(named(whole) for whole in wholes if whole.type != "Session")
    return [f"at {clock(last.interval.begin)}, {doing(last)}, {_distance(last, 0):.1f} m away (in {inside})"]


def _say_sharpest(memory: Memory, found: Recollection) -> list[str]:
    return listed(sorted(found, key=lambda turn: -abs(number(turn, "turn"))))


def _say_contacts_at_stands(memory: Memory, found: Recollection) -> list[str]:
    per_beacon = Counter(int(number(contact, "beacon")) for contact in found)
    counts = ", ".join(f"{count} with beacon {beacon}" for beacon, count in sorted(per_beacon.items()))
    whole = sum(
        memory.recall(cues.exactly("BeaconContact") & cues.time("superset", stand.interval)).exists()
        for stand in _stands(memory)
    )
    return [
        f"{per_beacon.total()} contacts: {counts}",
        f"some contact went on through the whole of {whole} of {len(_stands(memory))} stands",
    ]


def _say_last_contact(memory: Memory, found: Recollection) -> list[str]:
    pairs = list(found.latest_before(cues.exactly("BeaconContact")))
    known = [
        (turn.interval.begin - contact.interval.end, turn, contact)
        for turn, contact in pairs
        if contact is not None and contact.interval.end is not None
    ]
    wait, turn, contact = max(known, key=lambda one: one[0])
    typical = median(age.total_seconds() for age, _, _ in known)
    return [
        f"before {len(known)} of {len(pairs)} turns back some contact had ended, {typical:.1f} s earlier in the median",
        f"longest ago: {named(contact)}, {lasted(wait)} before the turn at {clock(turn.interval.begin)}",
    ]


def _say_per_beacon(memory: Memory, found: Recollection) -> list[str]:
    return [
        f"beacon {group.key}: {lasted(group.duration)} in {group.count} contacts"
        for group in found.groups(ByFeature(name="beacon"))
    ]


def _say_longest(memory: Memory, found: Recollection) -> list[str]:
    return listed(sorted(found, key=duration, reverse=True), lambda stand: f"{at(stand)} in {run_of(stand)}")


def _say_first(memory: Memory, found: Recollection) -> list[str]:
    first = found.first()
    assert first is not None  # noqa: S101 - the mower was there
    return [f"in the motion begun at {at(first)}; {found.count()} motions touched the area in all"]


def _say_each(memory: Memory, found: Recollection) -> list[str]:
    return listed(found)


def _say_episodes(memory: Memory, found: Recollection) -> list[str]:
    return numbers(found)


def _say_nearest(memory: Memory, found: Recollection) -> list[str]:
    return listed(found, lambda row: f"{named(row)}, begun at {clock(row.interval.begin)}")


def _say_out_of_touch(memory: Memory, found: Recollection) -> list[str]:
    silent = list(found)
    total = sum(map(duration, silent), timedelta())
    return [f"in {len(silent)} motions, {lasted(total)} together", *listed(silent)]


def _say_per_place(memory: Memory, found: Recollection) -> list[str]:
    return [
        f"{group.key}: {lasted(group.duration)} in {group.count} times"
        for group in found.groups(ByFeature(name="place"))
    ]


QUESTIONS = (
    Question(
        text="Which rows passed within 5 m of beacon 6?",
        cue=lambda memory: cues.exactly("Row") & _near(6, 5.0),
        say=_say_near_rows,
    ),
    Question(
        text="When was it last within 10 m of beacon 0, and what was it doing then?",
        cue=lambda memory: cues.is_a("Motion") & _near(0, 10.0),
        order="-begin",
        limit=1,
        say=_say_last_near,
    ),
    Question(
        text="Which turns were sharper than 257 degrees?",
        cue=lambda memory: cues.feature("turn", ">", 257) | cues.feature("turn", "<", -257),
        say=_say_sharpest,
    ),
    Question(
        text="Which beacon contacts overlap a stand?",
        cue=_contacts_at_stands,
        say=_say_contacts_at_stands,
    ),
    Question(
        text="Before each turn back (90 degrees or more), which contact was the last to end?",
        cue=lambda memory: cues.exactly("Turn") & (cues.feature("turn", ">=", 90) | cues.feature("turn", "<=", -90)),
        say=_say_last_contact,
    ),
    Question(
        text="How long was it in touch with each beacon of plaza1?",
        cue=lambda memory: (
            cues.exactly("BeaconContact") & cues.wholes("intersects", [session_of(memory, "plaza1").uid])
        ),
        say=_say_per_beacon,
    ),
    Question(
        text="Which stands lasted 10 s or more, the longest first?",
        cue=lambda memory: cues.exactly("Stand") & cues.lasting(">=", timedelta(seconds=10)),
        say=_say_longest,
    ),
    Question(
        text="What did it do right after its longest stand?",
        cue=_after_longest_stand,
        say=_say_each,
    ),
    Question(
        text="When did it first enter the northern end of plaza1?",
        cue=lambda memory: cues.is_a("Motion") & cues.region("intersects", NORTH_END),
        say=_say_first,
    ),
    Question(
        text="What happened in the tenth minute of plaza1?",
        cue=_minute_ten,
        say=_say_each,
    ),
    Question(
        text="Which rows are longer than 40 m, turns aside?",
        cue=lambda memory: cues.exactly("Row") & cues.feature("length", ">", 40),
        say=_say_episodes,
    ),
    Question(
        text="Which laps contain a stand, directly or in one of their rows?",
        cue=_laps_with_stands,
        say=_say_episodes,
    ),
    Question(
        text="What did it do in plaza1 farther than 28 m from every beacon?",
        cue=_far_from_beacons,
        say=_say_each,
    ),
    Question(
        text="Which three rows lie nearest to the middle of plaza1?",
        cue=lambda memory: cues.exactly("Row"),
        order=Nearest(to=MIDDLE),
        limit=3,
        say=_say_nearest,
    ),
    Question(
        text="When did it move or stand without any beacon in touch?",
        cue=_out_of_touch,
        say=_say_out_of_touch,
    ),
    Question(
        text=f"Which beacons did it come within {NEAR_BEACON:g} m of, how often and for how long in all?",
        cue=lambda memory: cues.exactly("BeaconVisit") | cues.exactly("BeaconPassage"),
        say=_say_per_place,
    ),
    Question(
        text=f"Which laps led by a beacon slowly, so that it was visited for {VISIT.total_seconds():g} s or more?",
        cue=_laps_with_visits,
        say=_say_episodes,
    ),
)
"""The tour's questions, in the order in which they are asked."""
