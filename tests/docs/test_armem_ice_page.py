"""docs/armem_ice.md is true: what it imports is there, and its numbers are those of the code."""

from __future__ import annotations

import ast
from importlib import import_module

import pytest

from armem_bridge.aron.data import DEPTH_LIMIT
from armem_bridge.config.values import PORT
from armem_bridge.ice.communicators import MESSAGE_KILOBYTES, PROPERTIES
from armem_bridge.ice.edge import NAME_SYSTEM, EdgeStatus, topic_of
from armem_bridge.ice.wire.aron import ELEMENTS_LIMIT
from tests.pages import Page

PAGE = Page("docs/armem_ice.md")
BLOCKS = PAGE.blocks("python")


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_what_the_examples_import_is_there(block: str) -> None:
    imports = [node for node in ast.walk(ast.parse(block)) if isinstance(node, ast.ImportFrom)]

    assert imports
    for node in imports:
        assert node.module is not None
        for alias in node.names:
            assert hasattr(import_module(node.module), alias.name)


def test_its_numbers_are_those_of_the_code() -> None:
    assert MESSAGE_KILOBYTES == 1024 * 1024
    assert "up to 1 GiB" in PAGE.text
    assert f"up to {PROPERTIES['Ice.ThreadPool.Server.SizeMax']} threads" in PAGE.text
    assert f"more than {DEPTH_LIMIT} levels" in PAGE.text
    assert ELEMENTS_LIMIT == 1_000_000
    assert "or a million elements" in PAGE.text
    assert f"-p {PORT}" in PAGE.text
    assert NAME_SYSTEM in PAGE.text
    assert topic_of("<memory>") in PAGE.text
    assert {"untimed", "versions"} <= set(EdgeStatus.__struct_fields__)
