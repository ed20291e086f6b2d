"""The house: imports point inwards only, each library has its rooms, and modules say what they are for."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

LAYERS: tuple[tuple[str, ...], ...] = (
    # The domain.
    ("elm.errors",),
    ("elm.text", "elm.arguments", "elm.chunks", "elm.lines"),
    ("elm.interval", "elm.geometry", "elm.features", "elm.taxonomy", "elm.fields"),
    ("elm.event", "elm.tombstone"),
    ("elm.extents",),
    ("elm.cues.relations",),
    ("elm.cues.algebra", "elm.exchange", "elm.columns", "elm.wordnet"),
    ("elm.cues.build", "elm.cues.codec", "elm.cues.match"),
    ("elm.cues",),
    # The ports, and the services that know nothing else.
    ("elm.query",),
    ("elm.store",),
    ("elm.log",),
    ("elm.writer", "elm.recollector", "elm.recognizers"),
    ("elm.loading", "elm.exporting", "elm.recognition", "elm.subscription"),
    ("elm.forgetting",),
    # The rooms that know SQL, and the wiring.
    ("elm.storage",),
    ("elm.app",),
    ("elm",),
    # The edges.
    ("elm.demo",),
    ("elm.cli",),
    ("elm.__main__",),
    # The bridge to ArmarX, a house of its own that stands on elm.
    ("armem_bridge.errors",),
    ("armem_bridge.moments",),
    ("armem_bridge.aron",),
    ("armem_bridge.memory_id",),
    ("armem_bridge.working",),
    ("armem_bridge.names", "armem_bridge.forgetting"),
    ("armem_bridge.long_term",),
    ("armem_bridge.forgetting_gate",),
    ("armem_bridge.long_term_forgetting", "armem_bridge.profiles", "armem_bridge.ice"),
    ("armem_bridge.config",),
    ("armem_bridge.service",),
    ("armem_bridge",),
    ("armem_bridge.demo",),
    ("armem_bridge.cli",),
)
"""Rooms from the inside out. A room imports from rooms before its own, and a package from itself."""

SHUT_DOORS: tuple[tuple[str, str, str], ...] = (
    ("elm.storage", "elm.writer", "stores know no services"),
    ("elm.storage", "elm.recollector", "stores know no services"),
    ("elm.storage", "elm.loading", "stores know no services"),
    ("elm.storage", "elm.exporting", "stores know no services"),
    ("elm.storage.cue_compiler", "elm.cues.match", "the meaning of a cue is written twice, independently"),
    ("elm.storage.postgres", "elm.cues.match", "the meaning of a cue is written twice, independently"),
    ("elm.storage.memory", "elm.storage.postgres", "the judge of a store is not that store"),
    ("elm.storage.memory", "elm.storage.cue_compiler", "the judge of a store is not that store"),
    ("elm.demo", "elm.storage", "the demo does what any user can do"),
    ("armem_bridge.working", "elm.app", "a memory server runs without a database"),
    ("armem_bridge.aron", "elm.app", "data objects are of use without a memory"),
)
"""(who, whom, why): not even by way of other modules of its own room."""

LIBRARIES: dict[str, tuple[str, ...]] = {
    "sqlalchemy": ("elm.storage",),
    "psycopg": ("elm.storage",),
    "alembic": ("elm.storage",),
    "geoalchemy2": ("elm.storage",),
    "rtree": ("elm.storage",),
    "sortedcontainers": ("elm.storage", "armem_bridge.working", "armem_bridge.long_term"),
    "pyarrow": ("elm.columns", "elm.exporting", "elm.storage"),
    "geopandas": ("elm.recollector",),
    "matplotlib": ("elm.demo",),
    "typer": ("elm.cli", "armem_bridge.cli"),
    "rich": ("elm.cli", "elm.demo", "armem_bridge.cli", "armem_bridge.demo"),
    "re2": ("armem_bridge.working",),
    "Ice": ("armem_bridge.ice",),
    "IceGrid": ("armem_bridge.ice",),
    "IceStorm": ("armem_bridge.ice",),
}
"""Who may import a library; libraries that are not listed may be imported by all."""

OPTIONAL = ("pyarrow", "geopandas")
"""Libraries that only an extra installs: imported where they are used, never with the module."""

MACHINE_PATHS = re.compile(r"""(?<![\w.~/}])/(?:work|tmp|root|home)(?:/|\b)(?!\w)""")


def modules_of(package: str) -> dict[str, Path]:
    """The modules of a package by their names."""
    names = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


HOUSES = ("elm", "armem_bridge")
MODULES = {name: path for house in HOUSES for name, path in modules_of(house).items()}
SOURCES = [
    path
    for package in ("elm", "armem_bridge", "simulators", "alembic", "tests")
    for path in sorted((ROOT / package).rglob("*.py"))
]


def parse(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def imported(nodes: Iterator[ast.AST]) -> Iterator[str]:
    """What import statements import: modules where a name is one, else the module it is taken from."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            assert node.module is not None
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in MODULES else node.module


def imports_of(module: str) -> set[str]:
    """Everything that a module imports anywhere in it."""
    return set(imported(ast.walk(parse(MODULES[module]))))


def within(module: str, room: str) -> bool:
    return module == room or module.startswith(f"{room}.")


def room_of(module: str) -> str | None:
    """The narrowest room that a module is in; the package itself is a room without inner ones."""
    rooms = [
        room for layer in LAYERS for room in layer if room == module or (room not in HOUSES and within(module, room))
    ]
    return max(rooms, key=len, default=None)


def layer_of(room: str) -> int:
    return next(number for number, layer in enumerate(LAYERS) if room in layer)


@pytest.mark.parametrize("module", MODULES)
def test_every_module_has_a_room(module: str) -> None:
    assert room_of(module), f"{module}: say in LAYERS where it belongs"


@pytest.mark.parametrize("module", MODULES)
def test_imports_point_inwards_only(module: str) -> None:
    own = room_of(module)
    assert own is not None

    for name in sorted(imports_of(module)):
        other = room_of(name) if name.partition(".")[0] in HOUSES else None
        if other is not None and other != own:
            assert layer_of(other) < layer_of(own), f"{module} imports {name}"


@pytest.mark.parametrize(("who", "whom", "why"), SHUT_DOORS)
def test_some_doors_are_shut_whichever_way_one_goes(who: str, whom: str, why: str) -> None:
    room = room_of(who)
    seen, waiting = set[str](), [module for module in MODULES if within(module, who)]
    assert waiting

    while waiting:
        module = waiting.pop()
        seen.add(module)
        for name in imports_of(module):
            assert not within(name, whom), f"{module} imports {name}: {why}"
            # The front room of the storage package opens any store: it is behind no store.
            if name in MODULES and room_of(name) == room and name not in seen and name != room:
                waiting.append(name)


@pytest.mark.parametrize("module", MODULES)
def test_libraries_stay_in_their_rooms(module: str) -> None:
    for name in imports_of(module):
        rooms = LIBRARIES.get(name.partition(".")[0])
        assert rooms is None or any(within(module, room) for room in rooms), f"{module} imports {name}"


@pytest.mark.parametrize("module", MODULES)
def test_optional_libraries_are_imported_where_they_are_used(module: str) -> None:
    found = {name.partition(".")[0] for name in imported(iter(parse(MODULES[module]).body))}

    assert not found & set(OPTIONAL)


@pytest.mark.parametrize("module", MODULES)
def test_no_module_is_named_like_one_of_python(module: str) -> None:
    assert module.rpartition(".")[2] not in sys.stdlib_module_names - {"__main__"}


def test_the_migrations_do_not_hide_the_library_of_their_name() -> None:
    assert not (ROOT / "alembic" / "__init__.py").exists()


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_module_opens_with_one_sentence(path: Path) -> None:
    sentence = (ast.get_docstring(parse(path)) or "").partition("\n\n")[0]

    assert sentence.endswith((".", "?")), "say in one sentence what the module is for"
    assert "\n" not in sentence, "one sentence on one line"
    assert not re.search(r"[.?!] [A-Z]", sentence), "one sentence, not several"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_module_depends_on_the_paths_of_a_machine(path: Path) -> None:
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        assert path == Path(__file__) or not MACHINE_PATHS.search(line), f"line {number}: {line.strip()}"
