"""Which cues a recognizer may ask: those whose answer never changes once an event has entered the log."""

from __future__ import annotations

from elm.cues.algebra import And, Cue, KinCue, Not, Or, TimeCue, node
from elm.cues.relations import Kin, TimeAxis
from elm.errors import InvalidValue


def check_pure(cue: Cue, *, what: str) -> Cue:
    """`cue`, unless it asks what a later commit may change or what only the memory knows."""
    if not isinstance(cue, Cue):
        raise InvalidValue(f"{what} needs a cue (elm.cues), not {cue!r:.80}")
    match node(cue):
        case And(args=args) | Or(args=args):
            for arg in args:
                check_pure(arg, what=what)
        case Not(arg=arg):
            check_pure(arg, what=what)
        case KinCue(kin=Kin.WHOLES):
            raise InvalidValue(f"{what} asks for wholes, which later commits add: a replay would answer otherwise")
        case KinCue(transitive=True):
            raise InvalidValue(f"{what} asks for parts of parts, which are not fed with an event: ask for direct parts")
        case TimeCue(axis=TimeAxis.RECORDED_AT):
            raise InvalidValue(f"{what} asks when an event was recorded: ask when it happened")
        case _:
            pass
    return cue
