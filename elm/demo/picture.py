"""The picture: both plazas as mowed, coloured by time, and below them the partonomy and the beacon contacts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from elm.app import Memory
from elm.demo.questions import session_of
from elm.demo.recording import RUNS
from elm.demo.style import CONTACT, INK, MOTIONS, MUTED, PAPER, minutes
from elm.demo.words import number
from elm.errors import MissingPackage
from elm.event import StoredEvent

try:
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    from elm.demo.map_view import draw_map
    from elm.demo.timeline import draw_timeline
except ImportError as error:
    raise MissingPackage("drawing the demo needs the package matplotlib: pip install 'elm-memory[plot]'") from error


def draw(memory: Memory, path: Path) -> None:
    """Draw what `memory` holds of the mower's runs into the PNG file `path`."""
    sessions = [session_of(memory, run) for run in sorted(RUNS)]
    figure = Figure(figsize=(16, 13.2), facecolor=PAPER)
    maps = figure.add_gridspec(1, len(sessions), left=0.045, right=0.965, top=0.9, bottom=0.395, wspace=0.17)
    lengths = [minutes(session.interval.begin, session) for session in sessions]
    widths = [max(length, 0.45 * max(lengths)) for length in lengths]
    lines = figure.add_gridspec(
        1, len(sessions), left=0.072, right=0.972, top=0.315, bottom=0.085, wspace=0.08, width_ratios=widths
    )
    for column, session in enumerate(sessions):
        draw_map(figure, figure.add_subplot(maps[0, column]), memory, session)
        draw_timeline(figure.add_subplot(lines[0, column]), memory, session, labelled=column == 0)
    _write_around(figure, sessions)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _write_around(figure: Figure, sessions: Sequence[StoredEvent]) -> None:
    total = sum(minutes(session.interval.begin, session) for session in sessions)
    metres = sum(number(session, "distance") for session in sessions)
    figure.text(0.03, 0.962, "What the mower remembers", size=23, weight="bold", color=INK)
    figure.text(
        0.03,
        0.938,
        f"{total:.0f} minutes and {metres / 1000:.1f} km of an autonomous mower among four radio beacons, "
        f"recalled from its episodic memory",
        size=12.5,
        color=MUTED,
    )
    figure.text(
        0.03,
        0.012,
        "Data: Plaza range-only data, Carnegie Mellon University (Djugash, Singh, Kantor), as distributed with GTSAM "
        "(BSD). Times count from the begin of each run; its day is not known.",
        size=8.5,
        color=MUTED,
    )
    kinds = [Patch(color=colour, label=kind.lower()) for kind, colour in MOTIONS.items()]
    figure.legend(
        handles=[*kinds, Patch(color=CONTACT, label="beacon contact")],
        loc="lower right",
        bbox_to_anchor=(0.976, 0.32),
        ncols=4,
        frameon=False,
        fontsize=10,
        labelcolor=INK,
        handlelength=1.2,
        columnspacing=1.4,
    )
