"""`elm up`, `elm down` and `elm status`: the private PostgreSQL cluster."""

from __future__ import annotations

import os
from dataclasses import asdict

import typer

from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.exits import ExitCode
from elm.cli.terminal import answers, progress, say


def up() -> None:
    """Start elm's private PostgreSQL cluster; it is created when there is none."""
    from elm.storage.cluster import Cluster

    cluster = Cluster.default()
    with progress("starting PostgreSQL", total=None, unit=""):
        cluster.up()
    say(f"the private cluster in {cluster.home} is running")
    if os.environ.get("ELM_DSN"):
        say("but ELM_DSN is set: commands use that database unless you unset it")


def down() -> None:
    """Stop the private cluster; nothing that was committed is lost."""
    from elm.storage.cluster import Cluster

    cluster = Cluster.default()
    ran = cluster.status().running
    with progress("stopping PostgreSQL", total=None, unit=""):
        cluster.down()
    say(f"the private cluster in {cluster.home} {'is stopped' if ran else 'was not running'}")


def status(output: RecordOutput = None) -> None:
    """Say whether the private cluster runs, and where; exit code 3 when it does not."""
    from elm.storage.cluster import Cluster

    cluster = Cluster.default()
    found = cluster.status()
    known = {**asdict(found), "dsn": cluster.dsn()}
    shown = {name: v if isinstance(v, int | None) else str(v) for name, v in known.items()}
    if record_format(output) is RecordFormat.JSONL:
        write_records([shown])
    else:
        from elm.cli.event_table import cell, plain_table

        table = plain_table("", "", show_header=False)
        for name, value in shown.items():
            words = {None: "none", True: "yes", False: "no"}
            text = words[value] if value is None or isinstance(value, bool) else str(value)
            table.add_row(name.replace("_", " "), cell(text))
        answers().print(table)
    if not found.running:
        raise typer.Exit(ExitCode.UNREACHABLE)
