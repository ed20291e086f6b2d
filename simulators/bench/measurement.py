"""One measurement from its command line to its report: the options that all share, the database, the ending."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from rich.console import Console

from elm.errors import ElmError
from simulators.bench.findings import Report
from simulators.bench.machine import circumstances, load_average
from simulators.bench.scratch import database

SEED = 1
INTERRUPTED = 130
"""The exit code of what was stopped by Ctrl-C, as shells have it."""


def options(command: str, description: str) -> ArgumentParser:
    """The options of every measurement; a measurement adds its own."""
    parser = ArgumentParser(prog=f"python -m simulators {command}", description=description)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures to this file")
    parser.add_argument("--quick", action="store_true", help="a small run, which shows that all works and little else")
    parser.add_argument("--dsn", help="the PostgreSQL database to measure in; default: ELM_DSN or the private cluster")
    parser.add_argument("--seed", type=int, default=SEED, metavar="N", help="seed of what is simulated; default 1")
    return parser


def run(command: str, given: Namespace, measure: Callable[[str, Namespace], Report]) -> int:
    """Measure, print, write; an error of elm is one line on stderr and exit code 1, Ctrl-C one line and 130."""
    # Fixed width where nobody watches: a log must not cut the figures off.
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 140)
    try:
        dsn = database(given.dsn)
        about = circumstances(dsn)
        before, begin = load_average(), perf_counter()
        report = measure(dsn, given)
    except ElmError as error:
        print(f"simulators {command}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"simulators {command}: stopped before the end; scratch memories are dropped", file=sys.stderr)
        return INTERRUPTED
    about |= {
        "measurement": command,
        "options": {name: str(value) for name, value in vars(given).items() if name not in ("json", "dsn")},
        "seconds": round(perf_counter() - begin, 1),
        "load_average": {"before": before, "after": load_average()},
    }
    remark = ", a quick run: too short to judge" if given.quick else ""
    load = f"load average {load_average()[0]} on {about['machine']['cores']} cores"
    report.show(f"{command}: goals ({load}{remark})", console)
    if about["settings"]["fsync"] != "on":
        print("fsync is off on this server: nothing here was durable", file=sys.stderr)
    if given.json is not None:
        report.write(given.json, about)
        console.print(f"all figures: {given.json}")
    return 0
