"""Offline forgetting: what long-term memory need not keep, by decay, frequency, similarity and budgets (section 4.5.3).

The mechanisms work one after another, each on what those before it left. They go through the snapshots of
an entity from the newest to the oldest, so that the newest stays and what is forgotten later is always
compared with what stays for good.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from armem_bridge.aron.vectors import Vector
from armem_bridge.forgetting.candidates import Candidate, by_entity
from armem_bridge.forgetting.distances import Compared, Matrix
from armem_bridge.forgetting.encoders import Encoder
from armem_bridge.forgetting.mechanisms import (
    NAMES,
    Frequency,
    LatentSimilarity,
    Offline,
    Retention,
    TimeDecay,
    combined,
)
from armem_bridge.forgetting.plan import Going, Plan
from armem_bridge.memory_id import MemoryID

Found = Iterator[tuple[Candidate, str]]
"""What goes, with the reason."""


def make_plan(
    candidates: Iterable[Candidate], mechanisms: Iterable[Offline], *, now: int, keep_newest: bool = True
) -> Plan:
    """What the mechanisms forget of the candidates at `now`, in microseconds.

    Neither the order of the mechanisms nor that of the candidates matters. A snapshot whose reference time
    is the greatest of its entity stays, unless `keep_newest` is False: then time decay and retention budgets
    may forget whole entities. Frequency and similarity keep it in any case.
    """
    ordered = combined(mechanisms, allowed=(TimeDecay, Frequency, LatentSimilarity, Retention), where="offline")
    entities = by_entity(candidates)
    work = _Work(entities=entities, now=now, keep_newest=keep_newest)
    everything = [candidate for remaining in entities.values() for candidate in remaining]
    unmet: list[str] = []
    for mechanism in ordered:
        match mechanism:
            case TimeDecay():
                for remaining in entities.values():
                    work.drop(mechanism, remaining, _decayed(mechanism, work.may_go(remaining), now))
            case Frequency():
                for remaining in entities.values():
                    work.drop(mechanism, remaining, _frequent(mechanism, remaining))
            case LatentSimilarity():
                for remaining in entities.values():
                    work.drop(mechanism, remaining, _similar(mechanism, remaining))
            case Retention():
                unmet += _retain(mechanism, work)
    return Plan(
        now=now,
        looked_at=len(everything),
        size=sum(candidate.size for candidate in everything),
        going=tuple(sorted(work.going, key=lambda going: going.snapshot)),
        unmet=tuple(unmet),
    )


@dataclass(slots=True, kw_only=True)
class _Work:
    """What remains of each entity while a plan is made, and what goes so far."""

    entities: dict[MemoryID, list[Candidate]]
    now: int
    keep_newest: bool
    going: list[Going] = field(default_factory=list)

    def may_go(self, remaining: Sequence[Candidate]) -> Sequence[Candidate]:
        """The remaining ones without the newest, if that stays; the earliest first."""
        return remaining[:-1] if self.keep_newest else remaining

    def drop(self, mechanism: Offline, remaining: list[Candidate], found: Iterable[tuple[Candidate, str]]) -> None:
        """Note what goes, all of it before anything is taken from the remaining ones."""
        name = NAMES[type(mechanism)]
        gone = {
            candidate.id: Going(snapshot=candidate.id, size=candidate.size, mechanism=name, why=why)
            for candidate, why in found
        }
        self.going += gone.values()
        remaining[:] = [candidate for candidate in remaining if candidate.id not in gone]


def _decayed(mechanism: TimeDecay, may_go: Sequence[Candidate], now: int) -> Found:
    for candidate in may_go:
        idle = candidate.idle(now)
        active = mechanism.activation(idle)
        if active < mechanism.minimum:
            yield candidate, f"not used for {idle:.1f} s, activation {active:.4g} < {mechanism.minimum:.4g}"


def _frequent(mechanism: Frequency, remaining: Sequence[Candidate]) -> Found:
    """What is too close in reference time before the next one that stays."""
    stays: int | None = None
    for candidate in reversed(remaining):
        moment = candidate.snapshot.referenced
        if stays is not None and (stays - moment) / 1e6 < mechanism.wait:
            yield candidate, f"{(stays - moment) / 1e6:.6g} s before {stays}, < {mechanism.wait:.6g} s"
        else:
            stays = moment


def _similar(mechanism: LatentSimilarity, remaining: Sequence[Candidate]) -> Found:
    """Algorithm 3: what is too near to the nearest of the last ones that stay."""
    compared = [candidate.compared for candidate in remaining]
    spaces = _spaces(compared, mechanism.encoder)
    staying: list[tuple[int, _Space]] = []
    for place in reversed(range(len(remaining))):
        space = spaces.get(place)
        if space is None:
            staying.append((place, _NOWHERE))
            continue
        last = staying[-mechanism.count :] if mechanism.count is not None else staying
        near = [other for other, theirs in last if theirs is space]
        code = space.codes[space.rows[place]]
        found = mechanism.measure(space.last(len(near)), code)
        best = int(found.argmin()) if near else -1
        if near and found[best] < mechanism.minimum:
            moment = remaining[near[best]].snapshot.referenced
            yield (
                remaining[place],
                f"{mechanism.distance} {found[best]:.4g} from {moment}, < {mechanism.minimum:.4g}",
            )
        else:
            staying.append((place, space))
            space.keep(code)


class _Space:
    """The codes of those snapshots of an entity that can be compared with each other, and which of them stay."""

    def __init__(self, places: Sequence[int], codes: Matrix) -> None:
        self.rows = {place: row for row, place in enumerate(places)}
        self.codes = codes
        self._staying = np.empty_like(codes)
        self._count = 0

    def keep(self, code: Vector) -> None:
        """One more stays."""
        self._staying[self._count] = code
        self._count += 1

    def last(self, count: int) -> Matrix:
        """The codes of the last ones that stay."""
        return self._staying[self._count - count : self._count]


_NOWHERE = _Space((), np.empty((0, 0)))


def _spaces(compared: Sequence[Compared], encoder: Encoder | None) -> dict[int, _Space]:
    """The space of each snapshot by its place; one without numbers is in none."""
    alike: dict[tuple[object, bytes, bool], list[int]] = {}
    for place, each in enumerate(compared):
        if each.vector.size:
            # Codes of numbers that are none would be none: such snapshots are compared as they are.
            encoded = encoder is not None and bool(np.isfinite(each.vector).all())
            alike.setdefault((each.layouts, each.rest, encoded), []).append(place)
    spaces: dict[int, _Space] = {}
    for (_, _, encoded), places in alike.items():
        vectors = np.stack([compared[place].vector for place in places])
        codes = encoder.fit(vectors).encode(vectors) if encoder is not None and encoded else vectors
        spaces |= dict.fromkeys(places, _Space(places, codes))
    return spaces


def _retain(mechanism: Retention, work: _Work) -> Iterator[str]:
    """Keep the budgets; says which could not be."""
    for entity, remaining in work.entities.items():
        if mechanism.age is not None:
            old = [each for each in work.may_go(remaining) if _age(each, work.now) > mechanism.age]
            work.drop(mechanism, remaining, [(each, f"older than {mechanism.age:g} s") for each in old])
        for budget, limit in (("snapshots", mechanism.count), ("bytes", mechanism.size)):
            if limit is not None:
                why = f"over {limit:,} {budget} of its entity"
                work.drop(mechanism, remaining, [(each, why) for each in _over([remaining], work, budget, limit)])
                yield from _missed(budget, limit, remaining, f"of {entity}")
    everything = list(work.entities.values())
    for budget, limit in (("snapshots", mechanism.total_count), ("bytes", mechanism.total_size)):
        if limit is not None:
            over = {each.id for each in _over(everything, work, budget, limit)}
            for remaining in everything:
                gone = [each for each in remaining if each.id in over]
                work.drop(mechanism, remaining, [(each, f"over {limit:,} {budget} in all") for each in gone])
            yield from _missed(budget, limit, [each for remaining in everything for each in remaining], "in all")


def _over(entities: Sequence[list[Candidate]], work: _Work, budget: str, limit: int) -> list[Candidate]:
    """The oldest that may go, until what is left keeps the budget."""
    left = sum(_counted(each, budget) for remaining in entities for each in remaining)
    may_go = [each for remaining in entities for each in work.may_go(remaining)]
    over: list[Candidate] = []
    for candidate in sorted(may_go, key=lambda each: (each.snapshot.referenced, each.id)):
        if left <= limit:
            break
        over.append(candidate)
        left -= _counted(candidate, budget)
    return over


def _missed(budget: str, limit: int, remaining: Sequence[Candidate], where: str) -> Iterator[str]:
    left = sum(_counted(each, budget) for each in remaining)
    if left > limit:
        yield f"{left:,} {budget} {where} stay, over the budget of {limit:,}: the newest snapshots of entities are kept"


def _counted(candidate: Candidate, budget: str) -> int:
    return candidate.size if budget == "bytes" else 1


def _age(candidate: Candidate, now: int) -> float:
    return (now - candidate.snapshot.referenced) / 1e6
