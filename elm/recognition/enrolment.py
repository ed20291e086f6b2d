"""Enrolment: seeing to types, definitions and who feeds whom before recognizers may work in a memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from elm.cues.algebra import Cue
from elm.cues.codec import cue_from_json
from elm.errors import DefinitionChanged, InvalidValue, UnknownType
from elm.log import LoggedStore
from elm.recognition.clocks import Timing
from elm.recognition.reports import StrandReport
from elm.recognition.strands import Strand, strands
from elm.recognizers.base import Judge, Recognizer
from elm.recognizers.purity import check_pure


def check_recognizers(recognizers: Sequence[Recognizer]) -> None:
    """Refuse what is no list of recognizers, or an empty one."""
    if isinstance(recognizers, str) or not isinstance(recognizers, Sequence) or not recognizers:
        raise InvalidValue(f"recognition needs a list of recognizers, at least one, not {recognizers!r:.80}")
    for each in recognizers:
        if isinstance(each, type) or not isinstance(each, Recognizer):
            raise InvalidValue(f"this is no recognizer (see elm.recognizers.Recognizer): {each!r:.80}")


def enrolled(
    store: LoggedStore, recognizers: Sequence[Recognizer], consumer: str, timing: Timing, judge: Judge
) -> list[Strand]:
    """The strands of recognizers that may work in a memory under a consumer's name.

    The memory then has the types of their results and knows their definitions.
    """
    found = known_strands(store, recognizers, timing, judge)
    refuse_changed(store, found)
    _refuse_rings(store, recognizers, consumer, judge)
    store.log.define(_definitions(found))
    return found


def known_strands(store: LoggedStore, recognizers: Sequence[Recognizer], timing: Timing, judge: Judge) -> list[Strand]:
    """The strands of recognizers whose types the memory has; it is given those of their results."""
    types = {output.name: output for recognizer in recognizers for output in recognizer.outputs}
    if types:
        store.add_types(list(types.values()))
    for recognizer in recognizers:
        check_pure(recognizer.interest, what=f"recognizer {recognizer.name!r}")
        try:
            for output in recognizer.outputs:
                judge.of_type(recognizer.interest, output.name)
        except UnknownType as error:
            raise UnknownType(f"recognizer {recognizer.name!r} looks for what cannot be: {error}") from error
    return strands(recognizers, judge, timing)


def _definitions(found: Sequence[Strand]) -> dict[str, str]:
    return {
        f"{recognizer.name} {recognizer.version}": fingerprint
        for strand in found
        for recognizer, fingerprint in zip(strand.recognizers, strand.fingerprints, strict=True)
    }


def refuse_changed(store: LoggedStore, found: Sequence[Strand]) -> None:
    """Refuse recognizers that worked here under the same version with another definition."""
    known = store.log.definitions()
    for name, fingerprint in _definitions(found).items():
        if known.get(name, fingerprint) != fingerprint:
            recognizer, version = name.rsplit(" ", 1)
            raise DefinitionChanged(
                f"recognizer {recognizer!r} of version {version} was defined otherwise when it last worked in this "
                f"memory: raise its version, so that its results can be told apart"
            )


def _refuse_rings(store: LoggedStore, recognizers: Sequence[Recognizer], consumer: str, judge: Judge) -> None:
    """Recognizers that feed each other share a consumer: else what they find would depend on who is faster."""
    known = [
        _Member(each.name, consumer, each.interest, tuple(output.name for output in each.outputs))
        for each in recognizers
    ]
    for other in store.log.progress():
        report = StrandReport.of(other)
        if report is not None and report.consumer != consumer:
            known += [
                _Member(told.name, report.consumer, cue_from_json(told.interest), told.outputs)
                for told in report.recognizers
            ]
    feeds = [
        {
            at
            for at, fed in enumerate(known)
            if any(judge.of_type(fed.interest, output) is not False for output in feeder.outputs)
        }
        for feeder in known
    ]
    for at, mine in enumerate(known[: len(recognizers)]):
        for other_at in _reached(at, feeds):
            if known[other_at].consumer != consumer and at in _reached(other_at, feeds):
                raise InvalidValue(
                    f"recognizer {mine.name!r} and {known[other_at].name!r} of consumer {known[other_at].consumer!r} "
                    f"would feed each other: let one consumer run both"
                )


class _Member(NamedTuple):
    """A recognizer of some consumer, as far as it matters who feeds whom."""

    name: str
    consumer: str
    interest: Cue
    outputs: tuple[str, ...]


def _reached(start: int, feeds: Sequence[set[int]]) -> set[int]:
    """Who is fed by one, directly or through others."""
    found: set[int] = set()
    waiting = [start]
    while waiting:
        fresh = feeds[waiting.pop()] - found
        found |= fresh
        waiting += fresh
    return found
