"""Parting: what is said to others at the end, to each of them whether or not the one before could be told."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable

_logger = logging.getLogger(__name__)


def part(farewells: Iterable[tuple[str, Callable[[], object]]]) -> None:
    """Call each of these; of those that fail the log says what was not done, for who is gone needs to hear nothing."""
    for what, tell in farewells:
        try:
            tell()
        except Exception as error:
            _logger.warning("at the end %s was not done: %s: %s", what, type(error).__name__, error)
