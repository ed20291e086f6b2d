"""Links to memory and points in time in data, as ArmarX's clients write them: by hand, by type, by generated class."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Data, Dict, Int, List, Long, String
from armem_bridge.aron.generation import generate
from armem_bridge.aron.realization import Level, realizes
from armem_bridge.aron.records import from_aron
from armem_bridge.aron.source_text import generate_source
from armem_bridge.errors import NotConvertible, NotRealized
from armem_bridge.memory_id import InvalidMemoryID, MemoryID
from armem_bridge.moments import INVALID
from tests.armem.aron.test_generation import module_of

CUP = MemoryID(memory="Object", core_segment="Instance", provider_segment="P", entity="cup", timestamp=7, instance=1)
AT = datetime(2026, 1, 1, 12, tzinfo=UTC)
MICROS = 1_767_268_800_000_000

FRAME = t.Object(
    name="Frame",
    members={
        "link": ALIASES["MemoryID"],
        "seen": ALIASES["DateTime"],
        "others": t.List(accepted=t.as_maybe(ALIASES["MemoryID"])),
    },
)


def time(micros: int) -> Dict:
    """A point in time as data have it."""
    return Dict({"timeSinceEpoch": Dict({"microSeconds": Long(micros)}), "clockType": Int(0), "hostname": String("")})


def link(**members: Data) -> Dict:
    """The link to the first instance of the cup."""
    known: dict[str, Data] = {
        "memoryName": String("Object"),
        "coreSegmentName": String("Instance"),
        "providerSegmentName": String("P"),
        "entityName": String("cup"),
        "timestamp": time(7),
        "instanceIndex": Int(1),
    }
    return Dict(known | members)


def test_an_id_is_a_link_of_armarx_type() -> None:
    assert CUP.to_aron() == link()
    assert realizes(CUP.to_aron(), ALIASES["MemoryID"]).level is Level.FULL
    assert MemoryID.from_aron(link()) == CUP


@pytest.mark.parametrize("one", [MemoryID(), MemoryID(memory="Object"), CUP.entity_id, CUP, MemoryID(entity="a/b%")])
def test_ids_come_back_from_data(one: MemoryID) -> None:
    assert MemoryID.from_aron(one.to_aron()) == one


def test_what_is_not_set_is_written_as_armarx_does() -> None:
    nothing = MemoryID().to_aron()

    assert nothing.elements["instanceIndex"] == Int(-1)
    assert nothing.elements["timestamp"] == time(INVALID)


def test_of_a_link_clock_host_and_strangers_are_not_looked_at_and_parts_may_be_missing() -> None:
    elsewhere = Dict({**time(7).elements, "clockType": Int(77), "hostname": String("armar-vision")})

    assert MemoryID.from_aron(link(timestamp=elsewhere, colour=String("red"))) == CUP
    assert MemoryID.from_aron(Dict({"memoryName": String("Object")})) == MemoryID(memory="Object")


@pytest.mark.parametrize(
    ("data", "error", "words"),
    [
        (None, NotRealized, "a link to memory is a Dict, not null"),
        (List([]), NotRealized, "a link to memory is a Dict, not a List"),
        (link(entityName=Int(1)), NotRealized, "entityName of a link to memory is a String, not a Int"),
        (link(instanceIndex=Long(1)), NotRealized, "instanceIndex .* is a Int, not a Long"),
        (link(timestamp=Long(7)), NotRealized, "a point in time is a Dict, not a Long"),
        (link(timestamp=Dict({})), NotRealized, "timeSinceEpoch of a point in time is a Dict, not null"),
        (link(entityName=String("\0")), InvalidMemoryID, "NUL"),
    ],
)
def test_what_is_no_link(data: Data | None, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        MemoryID.from_aron(data)


def test_ids_are_converted_with_a_type_and_without() -> None:
    assert to_aron({"link": CUP}) == Dict({"link": link()})
    assert to_aron([CUP, {"at": CUP}]) == List([link(), Dict({"at": link()})])
    assert to_aron(CUP, ALIASES["MemoryID"]) == link()
    assert to_aron(CUP, t.Any()) == link()


@pytest.mark.parametrize("at", [AT, AT.astimezone(timezone(timedelta(hours=2)))])
def test_datetimes_are_converted_where_the_type_says_so(at: datetime) -> None:
    assert to_aron(at, ALIASES["DateTime"]) == time(MICROS)
    assert to_aron({"link": CUP, "seen": at, "others": [CUP, None]}, FRAME) == Dict(
        {"link": link(), "seen": time(MICROS), "others": List([link(), None])}
    )


@pytest.mark.parametrize(
    ("value", "wanted", "words"),
    [
        ({"seen": AT}, None, "seen: a datetime has no ARON form: .* a type that says DateTime"),
        ({"seen": AT.replace(tzinfo=None)}, FRAME, "seen: the time is a datetime without a zone"),
        ({"seen": AT.replace(year=1969)}, FRAME, "seen: the time is before 1970"),
        ({"link": AT}, FRAME, "link: a datetime is no 'MemoryID'"),
        ({"seen": CUP}, FRAME, "seen: a MemoryID is no 'DateTime'"),
        ({"others": [None, AT]}, FRAME, r"others\[1\]: a datetime is no"),
        (CUP, t.Int(), "a MemoryID is no Int"),
        (AT, t.Long(), "a datetime is no Long"),
        ({"link": MemoryID}, None, "link: a StructMeta has no ARON form"),
        ({"link": MemoryID}, FRAME, "link: a StructMeta is no 'MemoryID'"),
    ],
)
def test_what_is_no_link_or_time_of_its_type(value: Any, wanted: t.TypeObject | None, words: str) -> None:
    with pytest.raises(NotConvertible, match=words):
        to_aron(value, wanted)


def classes(way: str, type_object: t.TypeObject) -> Any:
    """The generated classes, of either way."""
    if way == "at run time":
        return generate(type_object)
    return vars(module_of(generate_source(type_object)))


@pytest.mark.parametrize("way", ["at run time", "as text"])
def test_generated_classes_begin_as_not_set_and_take_ids_and_datetimes(way: str) -> None:
    made = classes(way, FRAME)
    frame = made["Frame"]

    assert MemoryID.from_aron(frame().link.to_aron()) == MemoryID()
    assert frame().seen.timeSinceEpoch.microSeconds == INVALID
    assert made["Duration"]().microSeconds == 0
    filled = frame(link=CUP, seen=AT, others=[CUP, None])
    assert realizes(filled.to_aron(), FRAME).level is Level.FULL
    assert filled.to_aron().elements["link"] == link()
    again = frame.from_aron(filled.to_aron())
    assert again == filled
    assert MemoryID.from_aron(again.link.to_aron()) == CUP
    assert (frame().to_aron().elements["link"], frame().to_aron().elements["seen"]) == (
        MemoryID().to_aron(),
        time(INVALID),
    )


def test_an_index_of_something_else_begins_as_any_other() -> None:
    other = t.Object(name="Other", members={"instanceIndex": t.Int(), "timeSinceEpoch": t.Long()})
    made: Any = generate(other)["Other"]()

    assert (made.instanceIndex, made.timeSinceEpoch) == (0, 0)


@dataclass
class Sighting:
    link: MemoryID
    seen: datetime
    before: MemoryID | None = None


def test_dataclasses_of_ones_own_have_links_and_times() -> None:
    data = Dict({"link": link(), "seen": time(MICROS), "before": None})

    assert from_aron(data, Sighting) == Sighting(link=CUP, seen=AT)
    with pytest.raises(NotRealized, match="link: a link to memory is a Dict"):
        from_aron(Dict({"link": Int(1), "seen": time(MICROS)}), Sighting)
    with pytest.raises(NotRealized, match="seen: the time is not set"):
        from_aron(Dict({"link": link(), "seen": time(INVALID)}), Sighting)
