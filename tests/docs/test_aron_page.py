"""docs/aron.md is true: its Python runs as it stands, its JSON goes there and back, its tables list all kinds."""

from __future__ import annotations

import json
import re

import pytest

from armem_bridge.aron import data, textual, type_objects
from tests.pages import Page

PAGE = Page("docs/aron.md")
DOCUMENTS = [line for block in PAGE.blocks("json") for line in block.splitlines()]


def test_the_python_of_the_page_runs() -> None:
    found = PAGE.blocks("python")
    assert len(found) >= 8
    PAGE.run(found)


@pytest.mark.parametrize("line", DOCUMENTS)
def test_the_json_of_the_page_goes_there_and_back(line: str) -> None:
    written = (
        textual.encode_type(textual.decode_type(line))
        if "type" in json.loads(line)
        else textual.encode(textual.decode(line))
    )
    assert json.loads(written) == json.loads(line)


def test_every_kind_of_data_has_an_example() -> None:
    shown = "".join(DOCUMENTS)
    for kind in data.KINDS:
        assert f'{{"{kind.__name__.lower()}": ' in shown, kind


@pytest.mark.parametrize(("section", "module"), [("Data objects", data), ("Type objects", type_objects)])
def test_the_tables_list_every_kind(section: str, module: object) -> None:
    rows = "".join(line for line in PAGE.sections[section].splitlines() if line.startswith("|"))
    named = set(re.findall(r"`(\w+)(?:\([\w, ]*\))?`", rows))
    kinds = data.KINDS if module is data else type_objects.KINDS
    assert {kind.__name__ for kind in kinds} <= named


def test_the_binary_form_has_every_kind() -> None:
    rows = [line.split("|")[1] for line in PAGE.sections["Binary form"].splitlines() if line.startswith("| ")]
    named = {name.strip() for row in rows for name in row.split(",")}
    assert {kind.__name__ for kind in data.KINDS} <= named
