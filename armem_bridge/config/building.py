"""Makes the values of a configuration out of the tables of its file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Final

from armem_bridge.config.mechanisms import offline_mechanisms, online_mechanisms
from armem_bridge.config.reading import read_tables
from armem_bridge.config.refusals import Place, named
from armem_bridge.config.segment_types import segment_type
from armem_bridge.config.tables import (
    FileTable,
    IceTable,
    LongTermTable,
    MemoryTable,
    PoseTable,
    RobotStateTable,
)
from armem_bridge.config.values import (
    Configuration,
    IceConfig,
    LongTermConfig,
    MemoryConfig,
    Mode,
    RobotStateConfig,
)
from armem_bridge.long_term.poses import PosePath
from armem_bridge.long_term.robot_place import check_footprint
from armem_bridge.long_term.settings import Consolidation, When
from armem_bridge.memory_id import Level, MemoryID
from armem_bridge.profiles import PROFILES, Profile
from armem_bridge.working.limits import UNLIMITED, HistoryLimits
from armem_bridge.working.segments import CoreSegmentDefinition

LONGEST: Final = 1e9
"""Seconds that any time in a configuration is shorter than."""


def read_config(file: Path | str) -> Configuration:
    """The configuration in a file. Raises `InvalidConfiguration`, naming file, key and remedy.

    Files that it names are looked for from its directory on. That they are there, and what else only the
    start of a service can tell (a database, a port), is not looked at here; type definitions are read.
    """
    file = Path(file)
    tables = read_tables(file)
    place = Place(file)
    if not tables.memories:
        place.refuse('there are no memories: add a table [[memories]], for example with profile = "ObjectMemory"')
    memories = [
        _memory(table, place / named("memories", table.name or table.profile, number))
        for number, table in enumerate(tables.memories)
    ]
    twice = [name for name, count in Counter(memory.name for memory in memories).items() if count > 1]
    if twice:
        place.refuse(f"two memories are called {twice[0]!r:.80}: give one of them another name")
    online = online_mechanisms(tables.forgetting.online, place / "forgetting.online")
    long_term = None
    if tables.long_term is not None:
        long_term = _long_term(tables.long_term, tables, memories, place / "long_term")
        if long_term.settings.when is When.ON_EVICTION and not any(map(_is_limited, memories)):
            (place / "long_term.when").refuse(
                "consolidates what leaves working memory, and nothing ever does, for no history has a limit: "
                'set history in [[memories]], or when = "on_commit"'
            )
    if online and (long_term is None or long_term.settings.when is not When.ON_EVICTION):
        (place / "forgetting.online").refuse(
            'says what of that which leaves working memory is kept: set when = "on_eviction" in [long_term]'
        )
    return Configuration(
        file=file,
        memories=tuple(memories),
        long_term=long_term,
        online=online,
        offline=offline_mechanisms(tables.forgetting.offline, place / "forgetting.offline"),
        keep_newest=tables.forgetting.offline.keep_newest,
        ice=_ice(tables.ice, place / "ice"),
    )


def _memory(table: MemoryTable, at: Place) -> MemoryConfig:
    profile = _profile(table, at)
    name = table.name or (profile.memory if profile is not None else "")
    if not name:
        at.refuse('has neither a name nor a profile: give one, for example profile = "ObjectMemory"')
    with (at / "name").said():
        memory = MemoryID(memory=name)
    core_segments = _core_segments(table, profile, at)
    return MemoryConfig(
        name=name,
        core_segments=core_segments,
        limits=_limits(table, memory, {segment.name for segment in core_segments}, at),
        prior_knowledge=tuple((at / "prior_knowledge").path(each) for each in table.prior_knowledge),
        delay_threshold=_microseconds(table.delay_warning, at / "delay_warning"),
        update_bytes=table.update_bytes,
    )


def _profile(table: MemoryTable, at: Place) -> Profile | None:
    if not table.profile:
        return None
    found = PROFILES.get(table.profile)
    if found is None:
        (at / "profile").refuse(f"there is no profile {table.profile!r:.80}: there are {', '.join(PROFILES)}")
    return found


def _core_segments(table: MemoryTable, profile: Profile | None, at: Place) -> tuple[CoreSegmentDefinition, ...]:
    """Those of the profile, in which the file's own take the place of those of the same name, then its others."""
    found: dict[str, CoreSegmentDefinition] = {}
    for each in profile.core_segments if profile is not None else ():
        found[each.name] = each.definition() if table.typed else CoreSegmentDefinition(name=each.name)
    own: set[str] = set()
    for number, segment in enumerate(table.core_segments):
        place = at / named("core_segments", segment.name, number)
        if not segment.name:
            (place / "name").refuse("is empty: name the core segment")
        if segment.name in own:
            place.refuse("is there twice: drop one")
        own.add(segment.name)
        aron_type = segment_type(segment.type, place / "type") if segment.type else None
        if aron_type is None and segment.name in found:
            continue
        found[segment.name] = CoreSegmentDefinition(name=segment.name, aron_type=aron_type)
    if not found:
        at.refuse("has no core segments: add [[memories.core_segments]], or a profile")
    return tuple(found.values())


def _limits(table: MemoryTable, memory: MemoryID, names: Collection[str], at: Place) -> dict[MemoryID, int]:
    limits: dict[MemoryID, int] = {}
    if table.history is not None:
        limits[memory] = table.history
    with (at / "history").said():
        HistoryLimits(limits)
    for number, segment in enumerate(table.core_segments):
        if segment.history is not None:
            where = memory.with_core_segment(segment.name)
            with (at / named("core_segments", segment.name, number) / "history").said():
                HistoryLimits({where: segment.history})
            limits[where] = segment.history
    for path, limit in table.history_limits.items():
        place = at / f'history_limits "{path}"'
        with place.said():
            where = MemoryID.parse(f"{memory}/{path}")
            HistoryLimits({where: limit})
        if where.core_segment not in names:
            place.refuse(f"there is no core segment {where.core_segment!r:.80}: add it, or correct this")
        if where in limits:
            place.refuse("the limit is there twice: drop one")
        limits[where] = limit
    return limits


def _is_limited(memory: MemoryConfig) -> bool:
    return any(limit != UNLIMITED for limit in memory.limits.values())


def _long_term(table: LongTermTable, file: FileTable, memories: Sequence[MemoryConfig], at: Place) -> LongTermConfig:
    place = Place(at.file)
    poses = [
        pose
        for number, (memory, given) in enumerate(zip(memories, file.memories, strict=True))
        for pose in _poses(memory, given, place / named("memories", memory.name, number))
    ]
    return LongTermConfig(
        memory=table.memory,
        dsn=table.dsn,
        robot=table.robot,
        frame=table.frame,
        settings=_settings(table, at),
        poses=tuple(poses),
        radius=table.radius,
        robot_state=_robot_state(table.robot_state, memories, at / "robot_state"),
    )


def _settings(table: LongTermTable, at: Place) -> Consolidation:
    given = {name: getattr(table, name) for name in ("backlog", "backlog_bytes", "wait", "patience")}
    with at.said():
        return Consolidation(
            when=table.when,
            at_stop=table.at_stop,
            durable=table.durable,
            **{name: value for name, value in given.items() if value is not None},
        )


def _poses(memory: MemoryConfig, table: MemoryTable, at: Place) -> Iterable[PosePath]:
    own = {segment.name: segment.poses for segment in table.core_segments if segment.poses is not None}
    profile = PROFILES.get(table.profile)
    for known in profile.core_segments if profile is not None else ():
        own.setdefault(known.name, list(known.poses))
    for number, (name, poses) in enumerate(own.items()):
        segment = MemoryID(memory=memory.name, core_segment=name)
        with (at / named("core_segments", name, number) / "poses").said():
            for each in poses:
                given = PoseTable(path=each) if isinstance(each, str) else each
                yield PosePath.at(given.path, unit=given.unit, segment=segment)


def _robot_state(table: RobotStateTable | None, memories: Sequence[MemoryConfig], at: Place) -> RobotStateConfig | None:
    if table is None:
        return None
    with (at / "segment").said():
        segment = MemoryID.parse(table.segment)
    known = {memory.name: {core.name for core in memory.core_segments} for memory in memories}
    if not Level.CORE_SEGMENT <= segment.level <= Level.ENTITY:
        (at / "segment").refuse(f"is the ID of a segment or entity, as RobotState/State, not {table.segment!r:.80}")
    if segment.core_segment not in known.get(segment.memory, set()):
        (at / "segment").refuse(f"there is no core segment {segment.cut(Level.CORE_SEGMENT)}: add it, or correct this")
    with (at / "pose").said():
        pose = PosePath.at(table.pose, unit=table.unit, segment=segment)
    if table.footprint is not None:
        with (at / "footprint").said():
            check_footprint(table.footprint)
    return RobotStateConfig(
        pose=pose,
        footprint=tuple(table.footprint) if isinstance(table.footprint, list) else table.footprint,
        max_age=None if table.max_age is None else _microseconds(table.max_age, at / "max_age"),
    )


def _ice(table: IceTable | None, at: Place) -> IceConfig:
    given = IceTable(mode=Mode.NONE) if table is None else table
    if given.mode is not Mode.NONE and not given.slices:
        (at / "slices").refuse(
            "is missing: name the directories of the ArmarX workspace that the robot's components were built from"
        )
    if given.mode is Mode.JOIN and not given.locator:
        (at / "locator").refuse(
            'is missing: give the Ice.Default.Locator of the robot, as "IceGrid/Locator:tcp -p 4061"'
        )
    if not 0 <= given.port < 65536:
        (at / "port").refuse(f"is from 0 (any that is free) to 65535, not {given.port}")
    return IceConfig(
        mode=given.mode,
        slices=tuple((at / "slices").path(each) for each in given.slices),
        host=given.host,
        port=given.port,
        endpoint=given.endpoint,
        locator=given.locator,
        own_name_system=given.own_name_system,
        properties=given.properties,
    )


def _microseconds(seconds: float, at: Place) -> int:
    if not 0 <= seconds < LONGEST:
        at.refuse(f"is a number of seconds from 0 on, not {seconds:g}")
    return round(seconds * 1_000_000)
