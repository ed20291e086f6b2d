"""Work that goes on until somebody says stop: what SIGINT and SIGTERM ask for, and what is warned of meanwhile."""

from __future__ import annotations

import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event as Signal
from typing import Any

from elm.cli.terminal import say


@contextmanager
def set_by_signals(stop: Signal) -> Iterator[None]:
    """Have SIGINT and SIGTERM set `stop`; a second one does what it does without elm."""

    def ask(number: int, frame: Any) -> None:
        stop.set()
        for each in before:
            signal.signal(each, signal.SIG_DFL)

    before = {each: signal.signal(each, ask) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Said(logging.Handler):
    """What is logged, as a line on stderr."""

    def emit(self, record: logging.LogRecord) -> None:
        """Say it."""
        say(f"elm: {record.getMessage()}")


@contextmanager
def warnings_said(*loggers: str) -> Iterator[None]:
    """Say on stderr what the loggers of these names warn of."""
    handler, told = _Said(level=logging.WARNING), [logging.getLogger(name) for name in loggers]
    for logger in told:
        logger.addHandler(handler)
    try:
        yield
    finally:
        for logger in told:
            logger.removeHandler(handler)
