"""What the thesis measured of working memory, as far as its text has numbers."""

from __future__ import annotations

from typing import Any, Final

SOURCE: Final = (
    "the thesis, section 5.2 (Peller-Konrad et al.: Robotics and Autonomous Systems 164, 2023); C++, over a network "
    "between computers with AMD Ryzen 9 5900X, ZeroC Ice"
)

LEAST_MICROSECONDS: Final = 100.0
"""What sending even a small object over the network takes at least."""

RETRIEVAL_HZ: Final = 160.0
"""How often a second moderate data can be retrieved, at least."""

CONVERSION_RATIO: Final = 15.0
"""How many times the conversion of a simple object that of a moderate one takes, about."""


def as_json() -> dict[str, Any]:
    """All of it, to stand beside figures of this machine."""
    return {
        "source": SOURCE,
        "least_microseconds": LEAST_MICROSECONDS,
        "retrieval_hz": RETRIEVAL_HZ,
        "moderate_conversion_vs_simple": CONVERSION_RATIO,
    }
