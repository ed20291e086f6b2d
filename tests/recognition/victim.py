"""A process that recognizes in small batches until it is killed; arguments: DSN MEMORY BATCH."""

from __future__ import annotations

import sys
from datetime import timedelta

from elm.recognition import RecognitionManager, Timing
from elm.storage.postgres import PostgresStore
from tests.recognition.scenes import recognizers

LATENESS = timedelta(seconds=3)
TIMING = Timing(lateness=LATENESS, idle=timedelta(days=1))


def main(dsn: str, memory: str, batch: str) -> None:
    """Catch up with the log, saying when work begins."""
    store = PostgresStore(dsn, memory)
    manager = RecognitionManager(store, recognizers(), timing=TIMING, batch=int(batch))
    print("at work", flush=True)
    manager.catch_up()
    store.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
