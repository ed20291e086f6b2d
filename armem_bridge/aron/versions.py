"""Versions: which generation of the bridge's codecs wrote an object, and which ones arrive on the wire."""

from __future__ import annotations

from collections import Counter
from threading import Lock
from typing import Final

from armem_bridge.errors import Undecodable, UnknownCodecVersion

MAJOR: Final = 1
"""Generation of the bridge's codecs: a reader that does not know it must not guess."""

MINOR: Final = 0
"""Raised when something is added that readers of this major version may pass over."""


def check_version(major: object, minor: object, *, what: str) -> None:
    """Refuse what a codec of another major version wrote; another minor version is read."""
    if type(major) is not int or type(minor) is not int or major < 0 or minor < 0:
        raise Undecodable(f"{what} names no version of the codec but {major!r:.40}.{minor!r:.40}: it is damaged")
    if major != MAJOR:
        raise UnknownCodecVersion(
            f"{what} was written by version {major}.{minor} of the ARON codec, and this elm reads {MAJOR}.x: "
            f"upgrade elm to read it"
        )


class VersionCounts:
    """How often which version of ARON came over the wire; safe to use from several threads.

    Versions differ between ArmarX's releases, and its Python client leaves that of an NDArray unset: a
    differing version is no error there. It is counted and shown, never refused. Of `DISTINCT` versions
    the counts are kept, by their first `SHOWN` characters; those of further ones are added up.
    """

    DISTINCT: Final = 50
    SHOWN: Final = 60
    OTHERS: Final = "(others)"

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = Lock()

    def add(self, version: str) -> None:
        """Count one object of this version, as text; empty where the sender left it unset."""
        version = version[: self.SHOWN]
        with self._lock:
            known = version in self._counts or len(self._counts) < self.DISTINCT
            self._counts[version if known else self.OTHERS] += 1

    def report(self) -> dict[str, int]:
        """The counts by version, the most frequent first."""
        with self._lock:
            return dict(sorted(self._counts.items(), key=lambda item: (-item[1], item[0])))
