"""What the parts of the picture share: the palette, quiet axes, and minutes since a run began."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from elm import cues
from elm.cues.algebra import Cue
from elm.event import StoredEvent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, MUTED, GROUND, PAPER = "#22303c", "#6b7885", "#f3f1ea", "#ffffff"
MOTIONS = {"Drive": "#3a8f8a", "Turn": "#e6a23c", "Stand": "#c8443c"}
CONTACT = "#6d5aa6"


def quiet(axes: Axes) -> None:
    """Take the frame and the ticks away, and mute the numbers."""
    axes.tick_params(colors=MUTED, length=0)
    axes.tick_params(axis="y", labelcolor=INK)
    for spine in axes.spines.values():
        spine.set_visible(False)


def inside(kind: str, session: StoredEvent) -> Cue:
    """Events of a kind within a session."""
    return cues.is_a(kind) & cues.wholes("superset", [session.uid], transitive=True)


def since(begin: datetime, moment: datetime) -> float:
    """Minutes from `begin` to `moment`."""
    return (moment - begin).total_seconds() / 60


def minutes(begin: datetime, event: StoredEvent) -> float:
    """Minutes from `begin` to the end of the event."""
    return since(begin, event.interval.end or event.interval.begin)
