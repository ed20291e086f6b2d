"""The timeline of one run: the partonomy in lanes, and below it the contacts with each beacon."""

from __future__ import annotations

from datetime import datetime

from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from elm import cues
from elm.app import Memory
from elm.demo.plaza import beacon_places
from elm.demo.style import CONTACT, INK, MOTIONS, MUTED, PAPER, inside, minutes, quiet, since
from elm.demo.words import number
from elm.event import StoredEvent

EPISODES = {"Session": ("#51606e",), "Lap": ("#8a9bab", "#a9b7c4"), "Row": ("#c3ced8", "#dbe2e8")}
"""Lanes from the top, with the colours that take turns in each."""


def draw_timeline(axes: Axes, memory: Memory, session: StoredEvent, *, labelled: bool) -> None:
    """Draw on `axes` what happened when in one session; the lanes are named where `labelled`."""
    begin = session.interval.begin
    length = minutes(begin, session)
    lane = 0.0
    names: list[tuple[float, str]] = []
    for kind, colours in EPISODES.items():
        lane -= 1
        names.append((lane, {"Session": "session", "Lap": "laps", "Row": "rows"}[kind]))
        found = [session] if kind == "Session" else list(memory.recall(inside(kind, session)))
        for index, event in enumerate(found):
            said = _session_words(event) if kind == "Session" else str(event.value("number"))
            _bar(axes, begin, event, lane, colours[index % len(colours)], length=length, said=said)
    lane -= 1
    names.append((lane, "motions"))
    for event in memory.recall(inside("Motion", session)):
        _bar(axes, begin, event, lane, MOTIONS[event.type], length=length)
    lane -= 0.35
    for beacon in beacon_places(str(session.value("run"))):
        lane -= 0.75
        names.append((lane, f"beacon {beacon}"))
        of_beacon = inside("BeaconContact", session) & cues.feature("beacon", "=", beacon)
        for event in memory.recall(of_beacon):
            _bar(axes, begin, event, lane, CONTACT, length=length, height=0.42)
    axes.set_xlim(-0.004 * length, 1.004 * length)
    axes.set_ylim(lane - 0.5, -0.45)
    axes.set_yticks([lane for lane, _ in names], [name if labelled else "" for _, name in names], color=INK, size=10.5)
    axes.xaxis.set_major_locator(MultipleLocator(5 if length > 12 else 1))
    axes.set_xlabel(f"minutes since {session.value('run')} began", color=MUTED)
    quiet(axes)


def _session_words(session: StoredEvent) -> str:
    return (
        f"session {session.value('run')}: {minutes(session.interval.begin, session):.1f} min, "
        f"{number(session, 'distance') / 1000:.2f} km"
    )


def _bar(
    axes: Axes,
    begin: datetime,
    event: StoredEvent,
    lane: float,
    colour: str,
    *,
    length: float,
    said: str = "",
    height: float = 0.82,
) -> None:
    left, right = since(begin, event.interval.begin), minutes(begin, event)
    axes.barh(
        lane,
        max(right - left, 0.02),
        left=left,
        height=height,
        color=colour,
        linewidth=0.5 if said else 0,
        edgecolor=PAPER,
    )
    if said and right - left > 0.007 * len(said) * length:
        axes.text(
            (left + right) / 2,
            lane,
            said,
            size=10.5 if event.type == "Session" else 7 if event.type == "Row" else 9,
            color=INK if event.type == "Row" else PAPER,
            ha="center",
            va="center_baseline",
        )
