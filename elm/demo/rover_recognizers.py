"""What the rover Spirit's life is recognized by: standstills, drives and visits to sites, from its positions alone."""

from __future__ import annotations

from datetime import timedelta

from elm import cues
from elm.recognizers import Pattern, Recognizer, Standstill, count, first, same, step, sum_of

LONGEST = timedelta(days=200)
"""Longer than the rover stayed anywhere: the longest winter at one position took 130 sols."""

STANDSTILLS = Standstill(
    name="rover-standstills",
    version=1,
    type="Standstill",
    parents=["Episode"],
    cue=cues.exactly("Stay"),
    radius=0.0,
    least=timedelta(days=10),
    gap=LONGEST,
    measures={"positions": count()},
)
"""Ten days and more in which the rover, of 1.2 m radius, always covered the point at which it stood first."""

DRIVES = Pattern(
    name="rover-drives",
    version=1,
    type="Drive",
    parents=["Episode"],
    elements=[
        step("reached", cues.exactly("Stay"), same("site", "reached"), same("start_sol", "reached"))
        .one_or_more()
        .strict()
    ],
    among=cues.exactly("Stay"),
    within=LONGEST,
    measures={
        "site": first("site"),
        "start_sol": first("start_sol"),
        "distance": sum_of("distance"),
        "positions": count(),
    },
)
"""The positions of one site that were reached on one sol; certain when the rover is elsewhere, or on a later sol."""

SITE_VISITS = Pattern(
    name="rover-site-visits",
    version=1,
    type="SiteVisit",
    parents=["Episode"],
    elements=[step("drive", cues.exactly("Drive"), same("site", "drive")).one_or_more().strict()],
    among=cues.exactly("Drive"),
    within=2 * LONGEST,
    measures={"site": first("site"), "distance": sum_of("distance"), "drives": count()},
)
"""Drives of one site that follow each other; certain with the first drive at another."""

RECOGNIZERS: tuple[Recognizer, ...] = (STANDSTILLS, DRIVES, SITE_VISITS)
