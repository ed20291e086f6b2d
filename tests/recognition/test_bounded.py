"""Bounded memory: what recognition holds does not grow with the length of the stream."""

from __future__ import annotations

import pytest

from simulators.recognizing import bounded

EVENTS = 1_000_000


@pytest.mark.slow
def test_a_million_events_leave_memory_as_a_hundred_thousand_do() -> None:
    found = bounded.measure(events=EVENTS, seed=1)
    tenth, half, whole = found["stages"]
    assert [stage["events"] for stage in found["stages"]] == [EVENTS // 10, EVENTS // 2, EVENTS]
    assert whole["matches"] > EVENTS // 10
    assert whole["dropped"] == 0
    # Some 2,000 events lie within the horizon, a third of which begins or goes on with something.
    for stage in (tenth, half, whole):
        assert 10 < stage["runs"] <= stage["most_runs"] < 300
        assert 10 < stage["held_events"] < 500
        assert stage["checkpoint_bytes"] < 100_000
    assert half["peak_mb"] - tenth["peak_mb"] < 2
    assert whole["peak_mb"] - tenth["peak_mb"] < 2
