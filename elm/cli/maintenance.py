"""`elm migrate` and `elm doctor`: bringing a memory's schema up to date, and what a maintainer would ask for."""

from __future__ import annotations

from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import progress, say, visible, write


@takes_groups
def migrate(
    *,
    where: MemoryOptions,
) -> None:
    """Create the memory, or bring its schema to this version of elm."""
    from elm.storage import migrate as migrate_memory

    with progress("migrating", total=None, unit=""):
        done = migrate_memory(where.dsn, where.memory)
    say(done)


@takes_groups
def doctor(
    *,
    where: MemoryOptions,
) -> None:
    """Print what a maintainer would ask for, without secrets; it works when things are broken."""
    from elm.cli.diagnosis import diagnosis

    for subject, finding in diagnosis(where.dsn, where.memory):
        write([f"{subject}: {visible(finding)}\n".encode()])
