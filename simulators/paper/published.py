"""What the paper measured in 2009, in milliseconds, with the place where it says so."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

SOURCE = (
    "D. Stachowicz, G.-J. M. Kruijff: Episodic-Like Memory for Cognitive Robots, section VI-B; "
    "IBM Thinkpad, Pentium M 1.7 GHz, 768 MB, PostgreSQL 8.3 with PostGIS 1.3.3"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """Times over all calls, and least and greatest mean and standard deviation among the classes of cues."""

    place: str
    mean: float
    sd: float
    max: float
    class_means: tuple[float, float] | None = None
    class_sds: tuple[float, float] | None = None


INSERTION = Published(place="VI-B2a and figure 7", mean=19.0, sd=110.0, max=8_200.0)
"""Committing one event."""

RETRIEVAL = MappingProxyType(
    {
        1: Published(
            place="VI-B2b", mean=145.0, sd=412.0, max=13_500.0, class_means=(14.0, 589.0), class_sds=(78.0, 776.0)
        ),
        2: Published(
            place="VI-B2c", mean=109.0, sd=301.0, max=18_100.0, class_means=(60.0, 221.0), class_sds=(196.0, 405.0)
        ),
        3: Published(
            place="VI-B2d", mean=129.0, sd=315.0, max=8_800.0, class_means=(83.0, 219.0), class_sds=(256.0, 422.0)
        ),
    }
)
"""Recalling by cues of one, two and three components."""

CLASS_MEANS = MappingProxyType({"type.exactly": 14.0, "type.is_a": 589.0})
"""The only classes of one component whose means the text of VI-B2b tells; figure 8 is about the second."""

CLASS_SDS = MappingProxyType({"type.exactly": 78.0, "region.intersects": 776.0})
"""The only classes whose standard deviations it tells."""


def as_json() -> dict[str, Any]:
    """All of it, to stand beside figures of this machine."""
    return {
        "source": SOURCE,
        "insertion": asdict(INSERTION),
        "retrieval": {str(components): asdict(found) for components, found in RETRIEVAL.items()},
        "class_means": dict(CLASS_MEANS),
        "class_sds": dict(CLASS_SDS),
    }
