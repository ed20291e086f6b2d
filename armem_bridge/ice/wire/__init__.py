"""The wire: what the bridge's values are as objects of the loaded slice files, and back, for every generation."""

from __future__ import annotations

from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire.aron import AronWire
from armem_bridge.ice.wire.commits import CommitWire
from armem_bridge.ice.wire.identifiers import IdentifierWire
from armem_bridge.ice.wire.queries import QueryWire
from armem_bridge.ice.wire.results import ResultWire


class Wire:
    """All conversions for one set of slice files."""

    def __init__(self, words: Vocabulary) -> None:
        self.words = words
        self.aron = AronWire(words)
        self.identifiers = IdentifierWire(words)
        self.commits = CommitWire(words, self.aron, self.identifiers)
        self.queries = QueryWire(words, self.identifiers)
        self.results = ResultWire(words, self.aron, self.identifiers)
