"""The demo: it says what is true of its minute, whichever store is behind it and however often it runs."""

from __future__ import annotations

import re
from io import StringIO

import pytest
from rich.console import Console

from armem_bridge.demo import run
from armem_bridge.demo.kitchen import SECONDS, SINK, TABLE, cup_at
from elm.app import connect
from elm.geometry import Region
from tests.servers import Server

_TIMES = re.compile(r"[0-9.]+ (ms|s|µs)( a commit| for the last)?")


def told(dsn: str) -> str:
    console = Console(file=StringIO(), width=200)
    run(memory="kitchen", dsn=dsn, console=console)
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def seconds_in(place: Region) -> list[int]:
    """When the disc around the cup lies inside a place."""
    return [second for second in range(SECONDS) if place.polygon.covers(Region.around(*cup_at(second), 0.05).polygon)]


def test_what_it_says_is_so() -> None:
    text = told("memory://")
    on_table = [second for second in seconds_in(TABLE) if 10 <= second <= 40]
    in_sink = seconds_in(SINK)

    assert "heard of 60 snapshots" in text
    assert "Consolidated 180 snapshots into the elm memory 'kitchen';" in text
    assert "has no valid referenced time (-1)" in text
    assert "has no core segment 'Klass'" in text
    assert "WM   10 snapshots, 10:00:50 to 10:00:59" in text
    assert "LTM  60 snapshots, 10:00:00 to 10:00:59" in text
    assert "BOTH 60 snapshots, 10:00:00 to 10:00:59" in text
    assert "a commit that came last: 10:00:17" in text
    assert f"from 10:00:10 to 10:00:40: {len(on_table)} snapshots, 10:00:10 to 10:00:{on_table[-1]}" in text
    assert f"inside the sink: {len(in_sink)} snapshots, 10:00:{in_sink[0]} to 10:00:59" in text
    assert "120 armem/Object/Instance:ObjectInstance, 60 armem/RobotState/State:RobotState" in text
    assert "96 by frequency" in text


def test_in_a_database_and_again(postgres_server: Server) -> None:
    with postgres_server.database() as dsn:
        first, second = told(dsn), told(dsn)
        with connect(dsn, "kitchen") as memory:
            assert memory.statistics().events == 180
    assert "Consolidated 0 snapshots into the elm memory 'kitchen', 180 were there already;" in second
    for one in (second, told("memory://")):
        assert _steady(one) == _steady(first)


def _steady(text: str) -> list[str]:
    return [_TIMES.sub("", line).rstrip() for line in text.splitlines() if "onsolidated" not in line]


def test_the_robot_was_where_it_says() -> None:
    """The robot drives at 1/15 m a second along y = 0, with a radius of 0.3 m, and the table begins at y = 0.5."""
    text = told("memory://")
    found = re.search(r"within 0.5 m of the table: (\d+) snapshots, 10:00:(\d+) to 10:00:(\d+)", text)
    assert found is not None
    # To the right of the table's corner (3.5, 0.5) the robot's edge may be 0.5 m away from it.
    reach = 3.5 + (0.8**2 - 0.5**2) ** 0.5 - 1.0
    assert [int(each) for each in found.groups()] == pytest.approx([reach * 15 + 1, 0, reach * 15], abs=1.5)
