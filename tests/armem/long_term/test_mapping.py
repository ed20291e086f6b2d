"""Snapshots become events and come back as they were, and one snapshot is one event however often it comes."""

from __future__ import annotations

from uuid import UUID

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from armem_bridge.aron.data import Dict, Int
from armem_bridge.errors import UnknownCodecVersion
from armem_bridge.long_term.mapping import arrival_of, below, is_snapshot, snapshot_of, snapshot_uid
from armem_bridge.long_term.payload import MEDIA_TYPE
from armem_bridge.long_term.refusals import NoSnapshot
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import GREATEST, InvalidMoment
from armem_bridge.working import Instance, Metadata, Snapshot
from elm.app import Memory
from elm.event import Event, Payload
from elm.geometry import Region
from elm.interval import Interval, from_micros
from tests.armem.aron.strategies import DATA
from tests.armem.long_term.memories import as_dict, in_process
from tests.armem.working.oracle import NAMES
from tests.armem.working.scenes import CUP, NOW, snapshot
from tests.conftest import StoreFactory

names = st.sampled_from([*NAMES, "a:b", "x\x1fy", "n" * 700, "%2F"])
moments = st.integers(0, 2**50)
ids = st.builds(MemoryID, memory=names, core_segment=names, provider_segment=names, entity=names, timestamp=moments)
dicts = st.dictionaries(st.sampled_from("abc"), DATA, max_size=2).map(Dict)


@st.composite
def snapshots(draw: st.DrawFn) -> Snapshot:
    """Snapshots with any number of instances, each with metadata of its own but for its time of arrival."""
    place, arrived = draw(ids), draw(moments)
    metadata = st.builds(
        Metadata,
        confidence=st.floats(allow_nan=False, allow_infinity=False),
        referenced=st.just(place.timestamp) | moments,
        sent=st.just(-1) | moments,
        arrived=st.just(arrived),
    )
    instances = st.lists(st.builds(Instance, data=st.none() | dicts, metadata=metadata), max_size=3)
    return Snapshot(id=place, instances=tuple(draw(instances)))


def kept(memory: Memory, given: Snapshot) -> Snapshot:
    """The snapshot as it comes back from an elm memory."""
    memory.add_type("Seen")
    assert memory.store.load([arrival_of(given, event_type="Seen")]).refused == ()
    (event,) = memory.recall(below(given.id))
    assert is_snapshot(event)
    return snapshot_of(event)


@given(snapshots())
def test_there_and_back(given: Snapshot) -> None:
    assert kept(in_process(), given) == given


@settings(max_examples=5)
@given(snapshots())
def test_there_and_back_in_every_store(store_factory: StoreFactory, given: Snapshot) -> None:
    assert kept(Memory(store_factory()), given) == given


@given(snapshots(), moments)
def test_the_time_of_arrival_is_no_content(given: Snapshot, arrived: int) -> None:
    later = [replace(each, metadata=replace(each.metadata, arrived=arrived)) for each in given.instances]
    again = replace(given, instances=tuple(later))

    one, other = arrival_of(given, event_type="Seen"), arrival_of(again, event_type="Seen")
    assert one.event == other.event
    if given.instances:
        assert other.recorded_at == from_micros(arrived)


def test_each_field_makes_another_uid() -> None:
    instance = Instance(data=as_dict({"x": 1}), metadata=Metadata(confidence=0.5, referenced=10, sent=7))
    base = Snapshot(id=CUP.with_timestamp(10), instances=(instance,))
    metadata = instance.metadata
    others = [
        replace(base, id=CUP.with_timestamp(11)),
        *(replace(base, id=replace(base.id, **{name: "x"})) for name in ("memory", "core_segment", "entity")),
        replace(base, id=replace(base.id, provider_segment="x")),
        replace(base, instances=(instance, instance)),
        replace(base, instances=()),
        replace(base, instances=(replace(instance, data=None),)),
        replace(base, instances=(replace(instance, data=as_dict({"x": 2})),)),
        *(
            replace(base, instances=(replace(instance, metadata=replace(metadata, **{name: 8})),))
            for name in ("confidence", "sent", "referenced")
        ),
    ]
    uids = [snapshot_uid(each) for each in (base, *others)]
    assert len(set(uids)) == len(others) + 1
    assert all(uid.version == 8 and uid.variant == "specified in RFC 4122" for uid in uids)


def test_neither_the_order_of_names_nor_the_sign_of_zero_of_a_confidence_does() -> None:
    def made(elements: dict[str, Int], confidence: float) -> Snapshot:
        metadata = Metadata(confidence=confidence, referenced=10)
        return Snapshot(id=CUP.with_timestamp(10), instances=(Instance(data=Dict(elements), metadata=metadata),))

    one, other = made({"a": Int(1), "b": Int(2)}, 0.0), made({"b": Int(2), "a": Int(1)}, -0.0)
    assert snapshot_uid(one) == snapshot_uid(other)


def test_uids_are_the_same_for_ever() -> None:
    instance = Instance(data=as_dict({"x": 1}), metadata=Metadata(confidence=0.5, referenced=10, sent=7))
    given = Snapshot(id=CUP.with_timestamp(10), instances=(instance,))

    assert snapshot_uid(given) == UUID("6f409311-8fa8-819d-87cd-004ebfdde061")


def test_what_an_event_says() -> None:
    place, thing = Region.around(1, 2, 0.3), Region.around(3, 4, 0.1)
    arrival = arrival_of(snapshot(10, sent=7), event_type="Seen", region=place, subject=thing, agent="armar7")
    event = arrival.event

    assert event.interval == Interval.at(from_micros(10))
    assert (event.region, event.subject, event.agent, event.type) == (place, thing, "armar7", "Seen")
    assert event.features == (
        ("armem.id", "Object/Instance/ObjectLocalizer/blue-cup"),
        ("armem.memory", "Object"),
        ("armem.core_segment", "Instance"),
        ("armem.provider_segment", "ObjectLocalizer"),
        ("armem.entity", "blue-cup"),
        ("armem.instances", 1),
        ("armem.confidence", 1.0),
        ("armem.sent", 7),
    )
    assert event.payload is not None
    assert event.payload.media_type == MEDIA_TYPE == "application/vnd.elm.armem-snapshot; version=1"
    assert arrival.recorded_at == from_micros(NOW)


def test_what_was_not_said_is_left_out() -> None:
    event = arrival_of(snapshot(10), event_type="Seen").event
    assert event.values("armem.sent") == ()
    empty = arrival_of(Snapshot(id=CUP.with_timestamp(10)), event_type="Seen")
    assert empty.recorded_at is None
    assert empty.event.values("armem.confidence") == ()
    assert empty.event.value("armem.instances") == 0


def test_times_that_elm_has_not_are_refused() -> None:
    with pytest.raises(InvalidMoment, match=r"Object/Instance/ObjectLocalizer/blue-cup/.* is beyond the year 9999"):
        arrival_of(snapshot(GREATEST), event_type="Seen")


@pytest.mark.parametrize(
    ("payload", "error", "says"),
    [
        (None, NoSnapshot, "has no payload"),
        (Payload(data=b"", media_type="text/plain"), NoSnapshot, "holds no instances"),
        (Payload(data=b"\x00", media_type=MEDIA_TYPE), NoSnapshot, "cannot be read"),
        (Payload(data=b"", media_type=MEDIA_TYPE.replace("=1", "=2")), UnknownCodecVersion, "upgrade elm"),
    ],
)
def test_events_that_are_no_snapshots_are_refused(payload: Payload | None, error: type[Exception], says: str) -> None:
    event = arrival_of(snapshot(10), event_type="Seen").event
    memory = in_process()
    memory.add_type("Seen")
    memory.commit(Event(type="Seen", interval=event.interval, features=event.features, payload=payload))
    (stored,) = memory.recall()

    with pytest.raises(error, match=says):
        snapshot_of(stored)


def test_a_snapshot_without_its_names_is_none() -> None:
    memory = in_process()
    memory.add_type("Seen")
    event = arrival_of(snapshot(10), event_type="Seen").event
    memory.commit(Event(type="Seen", interval=event.interval, payload=event.payload))
    (stored,) = memory.recall()

    with pytest.raises(NoSnapshot, match=r"lacks one of the features armem\.memory"):
        snapshot_of(stored)
