"""WordNet as event types: what a synset becomes, what is refused, and the whole of it where it is at hand."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import pytest

from elm.errors import InvalidValue
from elm.taxonomy import EventType
from elm.wordnet import read_wordnet, synset_types

HEADER = "id\tparents\tinstance_of\tlemmas\n"


def test_parents_and_classes_are_both_kinds() -> None:
    lines = [HEADER, "a\t\t\tentity\n", "b\ta\t\tthing,object\n", "c\ta,b\td\t\n", "d\t\ta,b\tx"]
    assert list(synset_types(lines)) == [
        EventType(name="a"),
        EventType(name="b", parents=("a",)),
        EventType(name="c", parents=("a", "b", "d")),
        EventType(name="d", parents=("a", "b")),
    ]


@pytest.mark.parametrize("lines", [[], ["a\t\t\tentity\n"], ["id,parents,instance_of,lemmas\n"]])
def test_another_table_is_refused(lines: list[str]) -> None:
    with pytest.raises(InvalidValue, match="not a list of synsets"):
        list(synset_types(lines))


@pytest.mark.parametrize("row", ["b\ta\n", "b\ta\t\tx\ty\n", "\n"])
def test_a_row_with_other_columns_is_named(row: str) -> None:
    with pytest.raises(InvalidValue, match="line 3 has"):
        list(synset_types([HEADER, "a\t\t\tentity\n", row]))


def test_files_are_read_plain_or_gzipped(tmp_path: Path) -> None:
    text = f"{HEADER}a\t\t\té\n".encode()
    plain, packed = tmp_path / "synsets.tsv", tmp_path / "synsets.tsv.gz"
    plain.write_bytes(text)
    packed.write_bytes(gzip.compress(text))
    assert read_wordnet(plain) == read_wordnet(packed) == [EventType(name="a")]


def test_a_damaged_file_is_said_to_be(tmp_path: Path) -> None:
    whole = gzip.compress(f"{HEADER}a\t\t\tx\n".encode())
    for name, data in {"cut.gz": whole[:-12], "no.gz": b"plain text", "latin.tsv": b"id\t\xe9"}.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InvalidValue, match=f"{name} cannot be read"):
            read_wordnet(tmp_path / name)


def test_the_whole_of_wordnet() -> None:
    data = os.environ.get("ELM_TEST_DATA")
    file = Path(data or "", "wordnet", "wn31_types.tsv.gz")
    if data is None or not file.exists():
        pytest.skip("WordNet is not at hand: ELM_TEST_DATA names no folder that has wordnet/wn31_types.tsv.gz")
    types = read_wordnet(file)
    assert len({each.name for each in types}) == len(types) == 95_981
    assert sum(len(each.parents) > 1 for each in types) == 2_247
    assert sum(len(each.parents) for each in types) == 97_761
