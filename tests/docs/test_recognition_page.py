"""The recognizers that docs/recognition.md shows are made as they stand there, and work in one memory together."""

from __future__ import annotations

from elm.cues.algebra import And, Cue, Not, Or, TypeCue, node
from elm.recognition import RecognitionManager
from elm.recognizers import Recognizer
from elm.storage.memory import MemoryStore
from elm.taxonomy import EventType
from tests.pages import Page

PAGE = Page("docs/recognition.md")


def _types(cue: Cue) -> set[str]:
    """The event types that a cue names."""
    match node(cue):
        case And(args=args) | Or(args=args):
            return set().union(*map(_types, args))
        case Not(arg=arg):
            return _types(arg)
        case TypeCue(type=name):
            return {name}
        case _:
            return set()


def test_the_recognizers_of_the_page_work() -> None:
    found: dict[str, Recognizer] = {}
    for block in PAGE.blocks("python"):
        values = [each for each in PAGE.run([block]).values() if not isinstance(each, type)]
        shown = {each.name: each for each in values if isinstance(each, Recognizer)}
        assert shown, "a block of the page makes no recognizer"
        assert not shown.keys() & found.keys(), "two of the page's recognizers have one name"
        found |= shown
    assert len(found) >= 9
    store = MemoryStore()
    needed = {name for each in found.values() for name in _types(each.interest)}
    needed |= {parent for each in found.values() for output in each.outputs for parent in output.parents}
    store.add_types([EventType(name=name) for name in sorted(needed)])
    manager = RecognitionManager(store, list(found.values()))
    manager.catch_up()
    assert {each.name for each in manager.status()} == set(found)
