"""The reports of strands: what is written is read again, whoever wrote it, and no other consumer's is taken for one."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import msgspec
import pytest

from elm import cues
from elm.cues.codec import cue_to_json
from elm.log import Progress
from elm.recognition.reports import Failures, RecognizerReport, StrandReport

INTEREST = cue_to_json(cues.is_a("A"))
LEAST: dict[str, Any] = {
    "consumer": "recognition",
    "recognizers": [{"name": "pair", "version": 2, "interest": INTEREST, "outputs": ["Pair", "HalfPair"]}],
}


def told(report: Mapping[str, Any]) -> Progress:
    return Progress(name="recognition/pair@1", position=3, report=report, updated_at=datetime.now(UTC))


def test_what_is_written_is_read_again() -> None:
    recognizer = RecognizerReport(
        name="pair", version=2, interest=INTEREST, outputs=("Pair",), fed=7, found=2, seconds=0.25, fed_here=3, split=1
    )
    report = StrandReport(
        consumer="recognition",
        recognizers=(recognizer,),
        late=1,
        forgotten=2,
        watermarks={"r": "2026-01-01T00:00:00+00:00", "": None},
        failures=1,
        error="upside down",
    )
    assert StrandReport.of(told(msgspec.json.decode(msgspec.json.encode(report.to_json())))) == report


def test_a_report_may_say_less_than_today_or_more() -> None:
    recognizer = RecognizerReport(name="pair", version=2, interest=INTEREST, outputs=("Pair", "HalfPair"))
    least = StrandReport(consumer="recognition", recognizers=(recognizer,))
    assert StrandReport.of(told(LEAST)) == least
    assert StrandReport.of(told({**LEAST, "mood": "good"})) == least


@pytest.mark.parametrize("report", [{}, {"forgotten": 2}], ids=["none yet", "a subscription"])
def test_other_consumers_are_no_strands(report: dict[str, Any]) -> None:
    assert StrandReport.of(told(report)) is None


def test_a_failing_strand_still_tells_what_it_did() -> None:
    known = StrandReport.of(told({**LEAST, "late": 4}))
    assert known is not None
    failing = known.failing(Failures(count=2, in_a_row=1, error="upside down"))
    assert (failing.late, failing.recognizers) == (4, known.recognizers)
    assert (failing.is_failing, failing.failures, failing.error) == (True, 2, "upside down")
