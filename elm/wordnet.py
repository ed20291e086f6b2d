"""Reading WordNet as an event type hierarchy: one type per synset, named by its id, below what it is a kind of."""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator
from pathlib import Path

from elm.errors import InvalidValue
from elm.taxonomy import EventType

_COLUMNS = ("id", "parents", "instance_of", "lemmas")


def read_wordnet(path: Path) -> list[EventType]:
    """The types in a tab-separated file of synsets, gzipped when its name ends in .gz."""
    try:
        with gzip.open(path, "rt", encoding="utf-8") if path.suffix == ".gz" else path.open(encoding="utf-8") as lines:
            return list(synset_types(lines))
    except (gzip.BadGzipFile, EOFError, UnicodeDecodeError) as error:
        raise InvalidValue(f"{path} cannot be read as text: {error}. Is it the whole file?") from error


def synset_types(lines: Iterable[str]) -> Iterator[EventType]:
    """The types on lines of `id, parents, instance_of, lemmas`; an instance counts as a kind of its class.

    Parents and classes are separated by commas. The lemmas are not kept: a type has a name and parents.
    """
    rows = iter(lines)
    if (header := next(rows, "").rstrip("\n").split("\t")) != [*_COLUMNS]:
        raise InvalidValue(
            f"not a list of synsets: its first line names the columns {', '.join(_COLUMNS)}, "
            f"separated by tabs, not {header!r:.80}"
        )
    for number, row in enumerate(rows, start=2):
        fields = row.rstrip("\n").split("\t")
        if len(fields) != len(_COLUMNS):
            raise InvalidValue(f"line {number} has {len(fields)} columns, not {len(_COLUMNS)}: {row!r:.80}")
        name, parents, classes, _ = fields
        yield EventType(name=name, parents=(*_listed(parents), *_listed(classes)))


def _listed(field: str) -> list[str]:
    return field.split(",") if field else []
