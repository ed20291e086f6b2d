"""The tour: commit a minute to the object memory of figure 4.7, ask working memory, long-term memory and elm."""

from __future__ import annotations

from collections.abc import Sequence
from inspect import getsource
from pathlib import Path
from time import perf_counter
from typing import Final

from msgspec.structs import replace
from rich.console import Console
from rich.markup import escape
from rich.syntax import Syntax

from armem_bridge.config import Configuration, read_config
from armem_bridge.demo import kitchen
from armem_bridge.demo.kitchen import CUP, OBJECTS, SINK, TABLE
from armem_bridge.long_term import LongTermMemory, recall_snapshots, snapshots_cue
from armem_bridge.long_term_forgetting import plan_forgetting
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import to_datetime
from armem_bridge.service import Service
from armem_bridge.working import Commit, EntityUpdate, MemoryServer, Query, QueryBuilder, QueryTarget, Snapshot
from elm import cues
from elm.app import Memory

CONFIG: Final = Path(__file__).with_name("kitchen.toml")
"""What the demo serves."""


def run(*, memory: str, dsn: str | None, console: Console) -> None:
    """Fill the elm memory of that name through two memory servers (again changes nothing), ask and answer."""
    config = read_config(CONFIG)
    assert config.long_term is not None  # noqa: S101 - the file says what it is
    config = replace(config, long_term=replace(config.long_term, memory=memory, dsn=dsn))
    console.print("[bold]A minute in a kitchen, as an ArmarX robot remembers it[/]")
    console.print("Two memory servers of table A.2 in this process, without Ice:", soft_wrap=True)
    console.print(Syntax(CONFIG.read_text(encoding="utf-8").rstrip(), "toml", background_color="default"))
    clock = kitchen.KitchenClock()
    with Service(config, clock=clock) as service:
        archive = service.archive
        assert archive is not None  # noqa: S101 - the configuration has one
        _commit(service, clock, console)
        _consolidate(archive, console)
        objects = service.names.resolve("Object")
        _refuse(objects, console)
        _query(objects, console)
        _recall(archive.memory, console)
        _forget(archive.memory, config, console)


def _commit(service: Service, clock: kitchen.KitchenClock, console: Console) -> None:
    objects, states = (service.names.resolve(name) for name in ("Object", "RobotState"))
    heard: list[MemoryID] = []
    subscription = objects.subscribe(heard.extend, CUP)
    commits = list(kitchen.commits())
    start = perf_counter()
    for commit in commits:
        robot, *seen = clock.receive(commit).updates
        states.commit(Commit(updates=[robot]))
        objects.commit(Commit(updates=seen))
    micros = (perf_counter() - start) / (2 * len(commits)) * 1e6
    subscription.flush(timeout=10)
    subscription.close()
    console.print(
        f"\n[bold]Committed[/] {2 * len(commits)} commits with {3 * len(commits)} updates, {micros:.0f} µs a commit; "
        f"a listener to {CUP} heard of {len(heard)} snapshots.",
        soft_wrap=True,
    )


def _consolidate(archive: LongTermMemory, console: Console) -> None:
    start = perf_counter()
    archive.flush(timeout=30)
    told = archive.status()
    known = f", {told['repeated']} were there already" if told["repeated"] else ""
    console.print(
        f"[bold]Consolidated[/] {told['consolidated']} snapshots into the elm memory {archive.memory.name!r}{known}; "
        f"waited {perf_counter() - start:.2f} s for the last.",
        soft_wrap=True,
    )


def _refuse(objects: MemoryServer, console: Console) -> None:
    wrong = EntityUpdate(entity=CUP, instances=kitchen.robot_at(0).instances, referenced=-1)
    typed = kitchen.seen(CUP.with_core_segment("Klass").with_provider_segment("x").with_entity("y"), (0.0, 0.0), 1)
    console.print("\n[bold]What is refused, and why[/]")
    for error in objects.commit(Commit(updates=[wrong, typed])).errors:
        console.print(f"    {escape(error)}", soft_wrap=True)


def _query(objects: MemoryServer, console: Console) -> None:
    console.print("\n[bold]Listing 4.9[/]")
    console.print(Syntax(getsource(_listing_4_9).rstrip(), "python", background_color="default"))
    for target, meaning in (
        (QueryTarget.WM, "working memory, as the history limit left it"),
        (QueryTarget.LTM, "long-term memory"),
        (QueryTarget.BOTH, "both, where the split does not show"),
    ):
        start = perf_counter()
        found = list(objects.query(_listing_4_9(target)).snapshots())
        millis = (perf_counter() - start) * 1000
        console.print(f"    {target.name:4} {_span(found)} [dim]{millis:.1f} ms[/]  {meaning}", soft_wrap=True)
    builder = QueryBuilder()
    cup = builder.core_segments.name("Instance").provider_segments.regex(".*Localizer").entities.name(CUP.entity)
    cup.snapshots.at_or_before(kitchen.moment(17.5))
    (late,) = objects.query(builder.build(target=QueryTarget.BOTH)).snapshots()
    console.print(f"    at or before 10:00:17.5, a commit that came last: {_clock(late)}", soft_wrap=True)


def _listing_4_9(target: QueryTarget) -> Query:
    builder = QueryBuilder()
    (
        builder.memories.name("Object")
        .core_segments.name("Instance")
        .provider_segments.name("ObjectLocalizer")
        .entities.name("blue-cup")
        .snapshots.all()
    )
    return builder.build(target=target)


def _recall(memory: Memory, console: Console) -> None:
    first, last = (to_datetime(kitchen.moment(second)) for second in (10, 40))
    console.print("\n[bold]What no ArmarX query can say: elm cues over the same snapshots[/]")
    for question, cue in (
        (
            "snapshots of the cup whose subject lies inside the table, from 10:00:10 to 10:00:40",
            cues.subject("subset", TABLE) & cues.time("subset", first, last),
        ),
        ("of the cup inside the sink", cues.subject("subset", SINK)),
        ("of the cup while the robot was within 0.5 m of the table", cues.within(0.5, TABLE)),
        ("of the cup where it was neither", ~cues.subject("intersects", TABLE) & ~cues.subject("intersects", SINK)),
    ):
        start = perf_counter()
        found = list(recall_snapshots(memory, cue, entity=CUP))
        millis = (perf_counter() - start) * 1000
        console.print(f"    {question}: {_span(found)} [dim]{millis:.1f} ms[/]", soft_wrap=True)
    types = memory.recall(snapshots_cue()).groups("type")
    console.print(f"    by type: {', '.join(f'{group.count} {group.key}' for group in types)}", soft_wrap=True)


def _forget(memory: Memory, config: Configuration, console: Console) -> None:
    console.print("\n[bold]What offline forgetting would take of the objects[/], in a dry run")
    plan = plan_forgetting(memory, config.offline, now=kitchen.moment(kitchen.SECONDS), wanted=OBJECTS)
    for entity, going in plan.by_entity().items():
        console.print(f"    {len(going)} of {escape(entity.entity)}, the first: {escape(going[0].why)}", soft_wrap=True)
    left = plan.looked_at - len(plan.going)
    by_mechanism = ", ".join(f"{count} by {name}" for name, count in plan.by_mechanism().items())
    console.print(f"    {by_mechanism}; {left} of {plan.looked_at} snapshots stay", soft_wrap=True)


def _span(found: Sequence[Snapshot]) -> str:
    if not found:
        return "none"
    return f"{len(found)} snapshots, {_clock(found[0])} to {_clock(found[-1])}"


def _clock(snapshot: Snapshot) -> str:
    return f"{to_datetime(snapshot.referenced):%H:%M:%S}"
