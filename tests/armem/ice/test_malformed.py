"""What no well-behaved client sends: malformed data, unknown queries, names that are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from armem_bridge.aron.data import DEPTH_LIMIT, Dict
from armem_bridge.ice import MemoryClient
from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit
from tests.armem.ice.processes import ClientProcess, ServerProcess
from tests.armem.ice.serving import SLICES
from tests.armem.ice.test_two_processes import committing, history, moments, querying, update


def commit_raw(client: MemoryClient, entity: MemoryID, *make: Callable[[Any], Any]) -> list[tuple[bool, str]]:
    """Commit data made by functions of the slice files' classes of ARON, each in an update of its own."""
    wire = client.wire
    updates = [update(entity, number, None) for number in range(1, len(make) + 1)]
    commit = wire.commits.write_commit(Commit(updates=updates))
    for each, function in zip(commit.updates, make, strict=True):
        each.instancesData = [function(wire.words.aron_data)]
    result = client.memory("Object").writing.commit(commit)
    return [(each.success, each.errorMessage) for each in result.results]


def good(dto: Any) -> Any:
    return dto.Dict(elements={"n": dto.AronLong(value=1)})


def short_array(dto: Any) -> Any:
    return dto.Dict(elements={"image": dto.NDArray(shape=[4, 4, 1], type="uint8", data=b"123")})


def negative_array(dto: Any) -> Any:
    return dto.Dict(elements={"image": dto.NDArray(shape=[-1, -1, 1], type="uint8", data=b"1")})


def huge_array(dto: Any) -> Any:
    return dto.Dict(elements={"image": dto.NDArray(shape=[2**31 - 1] * 4, type="uint8", data=b"")})


def abstract(dto: Any) -> Any:
    return dto.Dict(elements={"n": dto.GenericData()})


def nulls(dto: Any) -> Any:
    return dto.Dict(elements={"a": None, "b": dto.List(elements=[None, None])})


def itself(dto: Any) -> Any:
    data = dto.Dict(elements={})
    data.elements["again"] = data
    return data


def explosive(dto: Any) -> Any:
    """A few hundred bytes that name 10^12 elements."""
    data = dto.Dict(elements={"n": dto.AronLong(value=1)})
    for _ in range(12):
        data = dto.Dict(elements={str(number): data for number in range(10)})
    return data


def foreign_version(dto: Any) -> Any:
    data = good(dto)
    if isinstance(dto.Dict().VERSION, str):
        data.VERSION = "17.4 from elsewhere"
    else:
        data.VERSION.major = 17
    return data


def no_version(dto: Any) -> Any:
    """As the slice files leave it."""
    return good(dto)


def nested(dto: Any, levels: int) -> Any:
    data = dto.Dict(elements={})
    for _ in range(levels - 1):
        data = dto.Dict(elements={"d": data})
    return data


def as_deep_as_allowed(dto: Any) -> Any:
    return nested(dto, DEPTH_LIMIT)


def a_little_too_deep(dto: Any) -> Any:
    return nested(dto, DEPTH_LIMIT + 1)


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (short_array, r"NDArray of shape \[4, 4, 1\] has 16 bytes, not 3"),
        (negative_array, "extent below 0"),
        (huge_array, "an NDArray of shape"),
        (abstract, "GenericData, which the bridge cannot read"),
        (itself, "contains itself"),
        (explosive, "elements in all"),
        (a_little_too_deep, f"deeper than {DEPTH_LIMIT}"),
    ],
)
def test_malformed_data_are_refused_and_nothing_else(
    client: ClientProcess, server: ServerProcess, cup: MemoryID, make: Callable[[Any], Any], why: str
) -> None:
    malformed = server.ask("edge")["malformed"]

    first, second, third = client.call(commit_raw, cup, good, make, good)

    assert first == third == (True, "")
    assert not second[0]
    assert_matches(why, second[1])
    assert moments(client, cup) == [1, 3]
    assert server.ask("edge")["malformed"] == malformed + 1


def assert_matches(pattern: str, text: str) -> None:
    with pytest.raises(RuntimeError, match=pattern):
        raise RuntimeError(text)


def test_null_is_data_where_anything_is(client: ClientProcess, cup: MemoryID) -> None:
    assert client.call(commit_raw, cup, nulls, as_deep_as_allowed) == [(True, ""), (True, "")]
    found = client.call(querying, history(cup)).entity(cup)
    assert found is not None
    assert [each.instances[0].data.depth for each in found.snapshots() if each.instances[0].data] == [2, DEPTH_LIMIT]


def test_null_is_refused_where_a_type_does_not_allow_it(client: ClientProcess) -> None:
    grasp = MemoryID(memory="Object", core_segment="Grasp", provider_segment="p", entity="e")

    result = client.call(committing, update(grasp, 1, None), update(grasp, 2, Dict({"name": None})))

    assert [each.success for each in result.results] == [False, False]
    assert all("not of the type of its segment" in error for error in result.errors)


def test_versions_are_counted_and_never_refused(client: ClientProcess, server: ServerProcess, cup: MemoryID) -> None:
    before = server.ask("edge")["versions"]

    results = client.call(commit_raw, cup, foreign_version, no_version)

    after = server.ask("edge")["versions"]
    foreign = "17.4 from elsewhere" if server.generation == "gen3" else "2.17.0"
    unset = "" if server.generation == "gen3" else "2.0.0"
    assert results == [(True, ""), (True, "")]
    assert after[foreign] == before.get(foreign, 0) + 1
    assert after[unset] == before.get(unset, 0) + 1


def test_what_nests_without_bounds_ends_the_call_and_not_the_server(client: ClientProcess, cup: MemoryID) -> None:
    assert client.call(commit_abyss, cup) == "UnknownLocalException"

    assert client.call(committing, update(cup, 1)).success
    assert moments(client, cup) == [1]


def commit_abyss(client: MemoryClient, entity: MemoryID) -> str:
    try:
        commit_raw(client, entity, lambda dto: nested(dto, 2_000))
    except load_ice().Exception as error:
        return type(error).__name__
    return "nothing was raised"


def query_raw(client: MemoryClient, kind: str) -> tuple[bool, str]:
    """A query that is wrong in some way."""
    words = client.wire.words
    q = words.query
    queries: dict[str, Callable[[], list[Any]]] = {
        "null memory": lambda: [None],
        "null core": lambda: [q.memory.All(coreSegmentQueries=[None])],
        "base": lambda: [q.MemoryQuery()],
        "full moon": lambda: [all_entities(q, q.entity.FullMoon(which=3))],
        "no time": lambda: [all_entities(q, q.entity.BeforeTime())],
    }
    result = client.memory("Object").reading.query(q.Input(queries[kind](), True))
    assert result.memory is not None
    return result.success, result.errorMessage


def all_entities(q: Any, entity: Any) -> Any:
    providers = [q.provider.All(entityQueries=[entity])]
    return q.memory.All(coreSegmentQueries=[q.core.All(providerSegmentQueries=providers)])


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("null memory", "a query of the level memory is null"),
        ("null core", "a query of the level core is null"),
        ("base", "a query memory::MemoryQuery is unknown here: the bridge knows All, Single, Regex"),
        ("full moon", "a query entity::FullMoon is unknown here"),
        ("no time", "is not set"),
    ],
)
def test_a_query_that_cannot_be_is_refused_by_its_name(
    client: ClientProcess, server: ServerProcess, kind: str, why: str
) -> None:
    if server.generation == "gen3" and kind in ("full moon", "no time"):
        pytest.skip("the third generation has no such class to send")

    success, message = client.call(query_raw, kind)

    assert not success
    assert why in message


UNKNOWN = """
#include <RobotAPI/interface/armem/query.ice>
module armarx { module armem { module query { module data { module entity {
    class Tomorrow extends EntityQuery { int days; };
}; }; }; }; };
"""


def test_a_query_of_a_class_that_the_server_has_not_loaded(
    server: ServerProcess, client: ClientProcess, cup: MemoryID, tmp_path: Path
) -> None:
    (tmp_path / "Tomorrow.ice").write_text(UNKNOWN)
    with ClientProcess(server.generation, server.locator) as newer:
        error = newer.call(query_tomorrow, tmp_path / "Tomorrow.ice", SLICES / server.generation)

    assert "UnknownLocalException" in error
    assert "entity::Tomorrow" in error
    assert client.call(committing, update(cup, 1)).success


def query_tomorrow(client: MemoryClient, path: Path, slices: Path) -> str:
    """What comes of a query by a class that is known here only."""
    ice = load_ice()
    ice.loadSlice("", [f"-I{slice_directory()}", f"-I{slices}", "--underscore", "--all", str(path)])
    q = client.wire.words.query
    query = q.Input([all_entities(q, q.entity.Tomorrow(days=1))], True)
    try:
        client.memory("Object").reading.query(query)
    except ice.Exception as error:
        return f"{type(error).__name__} {error}"
    return "nothing was raised"


@pytest.mark.parametrize("part", ["memoryName", "coreSegmentName", "providerSegmentName", "entityName"])
def test_names_that_are_none(client: ClientProcess, cup: MemoryID, part: str) -> None:
    for name in ("", "nul\0"):
        ((success, message),) = client.call(commit_named, cup, part, name)
        assert not success
        assert message


def commit_named(client: MemoryClient, entity: MemoryID, part: str, name: str) -> list[tuple[bool, str]]:
    commit = client.wire.commits.write_commit(Commit(updates=[update(entity, 1)]))
    setattr(commit.updates[0].entityID, part, name)
    result = client.memory("Object").writing.commit(commit)
    return [(each.success, each.errorMessage) for each in result.results]
