"""Whether recognition keeps to its bounds: a long stream through a pattern with a short horizon, in a fresh process."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
from collections.abc import Iterator
from datetime import timedelta
from itertools import islice
from pathlib import Path
from typing import Any

from elm import cues
from elm.errors import StoreFailure
from elm.log import LogEntry
from elm.recognition import Timing, checkpoint
from elm.recognition.fold import Fold
from elm.recognition.judging import TypeJudge
from elm.recognition.manager import BATCH
from elm.recognition.strands import strands
from elm.recognition.work import Work
from elm.recognizers import AfterMatch, Pattern, step
from simulators.recognizing.engine import KINDS, OBJECTS, STEPS
from simulators.worlds import handling

HORIZON = timedelta(seconds=60)
PAUSE = 0.03
"""Seconds between two events on average: some 2,000 lie within the horizon."""
REPLACED = 1_000
"""Events after which all objects are new: partitions come and go as well."""
STAGES = (0.1, 0.5, 1.0)
"""Shares of the stream after which is looked at what is held."""


def measure(*, events: int, seed: int) -> dict[str, Any]:
    """What is held at each stage, and by how much the peak of memory grew from the first stage to the last."""
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-m", "simulators.recognizing.bounded", str(events), str(seed)],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    if done.returncode:
        raise StoreFailure("the process whose memory is measured ended with an error: see what it wrote above")
    stages = [json.loads(line) for line in done.stdout.splitlines()]
    return {
        "events": events,
        "horizon_seconds": HORIZON.total_seconds(),
        "stages": stages,
        "memory_bounded": stages[-1]["peak_mb"] / stages[0]["peak_mb"],
    }


def pattern() -> Pattern:
    """The pattern: three steps with one object within the horizon."""
    return Pattern(
        name="sequence",
        version=1,
        type="Sequence",
        elements=[step(kind, cues.is_a(kind)) for kind in STEPS],
        within=HORIZON,
        partition=["object"],
        after_match=AfterMatch.ALL,
    )


def stages(events: int, seed: int) -> Iterator[dict[str, Any]]:
    """Feed so many events, made one by one, and tell at each stage what is held."""
    types = [*handling.types(), *pattern().outputs]
    judge, timing = TypeJudge(lambda: types), Timing()
    (strand,) = strands([pattern()], judge, timing)
    work = Work(strand, judge)
    fold = Fold([work], timing, frozenset([strand.recognizers[0].name]))
    life = handling.live(seed, kinds=KINDS, objects=OBJECTS, pause=PAUSE, replaced=REPLACED)
    entries: Iterator[LogEntry] = (handling.entry(done, at) for at, done in enumerate(life, start=1))
    fed = matches = most_runs = 0
    for share in STAGES:
        until = round(events * share)
        while fed < until:
            taken = fold.take(islice(entries, min(BATCH, until - fed)))
            fed += min(BATCH, until - fed)
            matches += len(taken.results)
            most_runs = max(most_runs, _counts(work)["partial"])
        yield {
            "events": fed,
            "matches": matches,
            "runs": _counts(work)["partial"],
            "most_runs": most_runs,
            "dropped": _counts(work)["dropped"],
            "held_events": len(fold.snapshot(strand.name)[1]),
            "checkpoint_bytes": len(checkpoint.taken(fold, strand.name)),
            "peak_mb": _peak(),
        }


def _counts(work: Work) -> dict[str, int]:
    (counted,) = work.counts().values()
    return counted


def _peak() -> float:
    """The most memory that this process has had so far, in MiB."""
    told = Path("/proc/self/status")
    if told.exists():
        # The kernel's own count: that of `getrusage` has begun with the memory of the process that started this one.
        kilobytes = next(line for line in told.read_text().splitlines() if line.startswith("VmHWM:")).split()[1]
        return int(kilobytes) / 2**10
    unit = 1 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20


if __name__ == "__main__":
    for told in stages(int(sys.argv[1]), int(sys.argv[2])):
        print(json.dumps(told), flush=True)
