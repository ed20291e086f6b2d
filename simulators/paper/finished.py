"""The finished runs beside the file of the figures: written at once, and not run again by the next try."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from simulators.bench.files import write_json
from simulators.paper.schedule import Answer, Course
from simulators.paper.times import Times

_ROOT = Path(__file__).resolve().parents[2]
_SOURCES = ("elm", "simulators")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finished:
    """A run that is over: what it measured, and how long it took under which load."""

    course: Course
    times: Times
    seconds: float
    started: str
    load_average: Mapping[str, Any]


def beside(file: Path) -> Path:
    """The directory of the finished runs whose figures go to `file`."""
    return file.with_name(f"{file.stem}.runs")


def conditions(about: Mapping[str, Any]) -> dict[str, Any]:
    """What must be the same for runs to be of one experiment: machine, versions, server settings and code.

    The code is told by its commit; where files differ from that, by what is in them.
    """
    commit = about["commit"]
    if commit is None or commit.endswith("-dirty"):
        commit = f"{commit} {_digest()}"
    return {**{name: about[name] for name in ("machine", "versions", "settings")}, "code": commit}


def keep(directory: Path | None, finished: Finished, under: Mapping[str, Any]) -> None:
    """Write a finished run to its file, whole or not at all; nowhere without a directory."""
    if directory is None:
        return
    written = {
        "course": _as_written(finished.course),
        "conditions": dict(under),
        "seconds": finished.seconds,
        "started": finished.started,
        "load_average": dict(finished.load_average),
        "times": finished.times.as_json(),
    }
    write_json(_file(directory, finished.course, under), written)


def find(directory: Path | None, course: Course, under: Mapping[str, Any]) -> Finished | None:
    """The run as an earlier try finished it under these conditions; None where there is no such run."""
    if directory is None or not (file := _file(directory, course, under)).exists():
        return None
    written = json.loads(file.read_text(encoding="utf-8"))
    return Finished(
        course=course,
        times=Times.of_json(written["times"]),
        seconds=written["seconds"],
        started=written["started"],
        load_average=written["load_average"],
    )


def differences(directory: Path | None, course: Course, under: Mapping[str, Any]) -> set[str]:
    """What is different in runs of this name that are of other settings or were run under other conditions."""
    if directory is None:
        return set()
    wanted = {**_as_written(course), **under}
    different = set()
    for file in directory.glob(f"{course.name}-*.json"):
        written = json.loads(file.read_text(encoding="utf-8"))
        before = {**written["course"], **written["conditions"]}
        different |= {name for name in {*wanted, *before} if wanted.get(name) != before.get(name)}
    return different


def _file(directory: Path, course: Course, under: Mapping[str, Any]) -> Path:
    """Another file for other settings and conditions: no run ever takes the place of a different one."""
    told = json.dumps([_as_written(course), dict(under)], sort_keys=True)
    return directory / f"{course.name}-{hashlib.sha256(told.encode()).hexdigest()[:12]}.json"


def _as_written(course: Course) -> dict[str, Any]:
    return {name: str(value) if isinstance(value, Answer) else value for name, value in asdict(course).items()}


def _digest() -> str:
    """SHA-256 over the names and the contents of all modules."""
    digest = hashlib.sha256()
    for file in sorted(file for name in _SOURCES for file in (_ROOT / name).rglob("*.py")):
        digest.update(str(file.relative_to(_ROOT)).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()
