"""Loading JSON Lines: every line is kept, there already, or refused by number, whatever batch it fell into."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep
from typing import IO
from uuid import UUID

import pytest

from elm.app import Memory, connect
from elm.errors import CycleRefused, DatabaseUnreachable, InvalidValue, StoreClosed
from elm.lines import Waiting
from elm.loading import FileReport, RefusedLine, load_lines, load_stream, read_types
from elm.storage.memory import MemoryStore
from elm.taxonomy import EventType
from elm.writer import LOAD_BATCH
from tests.clock import at


@pytest.fixture
def memory() -> Memory:
    memory = Memory(MemoryStore())
    memory.add_types([EventType(name="Drive"), EventType(name="Trip")])
    return memory


def drive(number: int, **more: object) -> bytes:
    event = {"uid": str(UUID(int=number)), "type": "Drive", "interval": [at(number).isoformat(), None], **more}
    return json.dumps(event).encode() + b"\n"


def load(memory: Memory, *lines: bytes) -> tuple[FileReport, list[RefusedLine]]:
    refused: list[RefusedLine] = []
    return load_lines(memory.writer, lines, refused=refused.append), refused


def test_all_lines_are_accounted_for(memory: Memory) -> None:
    lines = [drive(1), drive(2, type="Dance"), drive(1), b"\n", b"{}\n", drive(3), drive(1, agent="x"), b" \r\n"]
    report, refused = load(memory, *lines)
    assert report == FileReport(read=6, new=2, existing=1, refused=3, ignored={})
    assert [line.number for line in refused] == [2, 5, 7]
    assert [line.line for line in refused] == [lines[1][:-1], lines[4][:-1], lines[6][:-1]]
    assert "'Dance'" in refused[0].reason
    assert "'type'" in refused[1].reason
    assert memory.recall().count() == 2


def test_refused_lines_come_in_order_across_batches(memory: Memory) -> None:
    bad = {3, LOAD_BATCH - 1, LOAD_BATCH, LOAD_BATCH + 7, 2 * LOAD_BATCH + 1, 2 * LOAD_BATCH + 2}
    lines = [
        (b"no JSON" if number % 2 else drive(number, type="Dance")) if number in bad else drive(number)
        for number in range(1, 2 * LOAD_BATCH + 3)
    ]
    report, refused = load(memory, *lines)
    assert [line.number for line in refused] == sorted(bad)
    assert [line.line for line in refused] == [lines[number - 1].rstrip(b"\n") for number in sorted(bad)]
    assert (report.read, report.new, report.refused) == (len(lines), len(lines) - len(bad), len(bad))


def test_equal_lines_without_uid_are_refused_each_by_its_own_number(memory: Memory) -> None:
    line = json.dumps({"type": "Dance", "interval": [at(0).isoformat(), None]}).encode()
    _, refused = load(memory, line, line, line)
    assert [found.number for found in refused] == [1, 2, 3]


def test_a_file_of_refused_lines_alone_is_told_too(memory: Memory) -> None:
    report, refused = load(memory, b"x\n", b"y")
    assert [(line.number, line.line) for line in refused] == [(1, b"x"), (2, b"y")]
    assert report == FileReport(read=2, new=0, existing=0, refused=2, ignored={})


def test_nothing_is_loaded_from_nothing(memory: Memory) -> None:
    assert load(memory) == (FileReport(read=0, new=0, existing=0, refused=0, ignored={}), [])


def test_results_load_back_with_their_time_of_recording(memory: Memory) -> None:
    results = [drive(number, id=number + 70, wholes=[], recorded_at=at(99).isoformat()) for number in (1, 2)]
    report, _ = load(memory, *results, drive(3, id=80))
    assert report.ignored == {"id": 3, "wholes": 2}
    assert [event.recorded_at for event in memory.recall(order="id", limit=2)] == [at(99), at(99)]
    assert memory.get(UUID(int=1)).id != 71


def test_parts_may_stand_earlier_in_the_file_but_not_later(memory: Memory) -> None:
    parts = [str(UUID(int=1))]
    whole = {"type": "Trip", "parts": parts}
    line = json.dumps(whole).encode()
    report, refused = load(memory, line, drive(1), line)
    assert (report.new, [found.number for found in refused]) == (2, [1])


def test_a_byte_order_mark_is_no_part_of_the_first_line(memory: Memory) -> None:
    mark = b"\xef\xbb\xbf"
    report, refused = load(memory, mark + drive(1), mark + drive(2))
    assert report.new == 1
    assert refused[0].line == mark + drive(2)[:-1]


def test_progress_counts_the_bytes_of_all_lines(memory: Memory) -> None:
    lines = [*map(drive, range(1, LOAD_BATCH + 2)), b"no JSON\n", b"\n"]
    done: list[int] = []
    load_lines(memory.writer, lines, refused=lambda line: None, progress=done.append)
    assert done == sorted(done)
    assert done[0] == sum(map(len, lines[:LOAD_BATCH]))
    assert done[-1] == sum(map(len, lines))


@pytest.fixture
def refused_file(tmp_path: Path) -> Path:
    return tmp_path / "events.refused.jsonl"


def test_the_refused_file_holds_the_lines_as_they_stood(memory: Memory, refused_file: Path) -> None:
    refused_file.write_text("left by an earlier load\n")
    numbers: list[int] = []
    stream = io.BytesIO(b'{"type" : 1}\r\n' + drive(1) + b"\xff")
    load_stream(memory.writer, stream, refused_file=refused_file, refused=lambda line: numbers.append(line.number))
    assert numbers == [1, 3]
    assert refused_file.read_bytes() == b'{"type" : 1}\r\n\xff\n'


def test_a_load_that_fails_leaves_the_refused_lines_of_an_earlier_one(memory: Memory, refused_file: Path) -> None:
    """For lines that came by a pipe they are the only copy."""
    refused_file.write_bytes(b"left by an earlier load\n")
    memory.close()
    with pytest.raises(StoreClosed):
        load_stream(memory.writer, io.BytesIO(drive(1)), refused_file=refused_file, refused=lambda line: None)
    assert refused_file.read_bytes() == b"left by an earlier load\n"
    assert list(refused_file.parent.iterdir()) == [refused_file]


def test_a_load_from_an_unreachable_server_leaves_them_too(refused_file: Path) -> None:
    refused_file.write_bytes(b"left by an earlier load\n")
    with connect("host=127.0.0.1 port=1 dbname=elm") as memory, pytest.raises(DatabaseUnreachable):
        load_stream(memory.writer, io.BytesIO(drive(1)), refused_file=refused_file, refused=lambda line: None)
    assert refused_file.read_bytes() == b"left by an earlier load\n"


def test_a_load_that_fails_later_keeps_the_lines_it_refused_until_then(memory: Memory, refused_file: Path) -> None:
    refused_file.write_bytes(b"left by an earlier load\n")

    def broken(_: int) -> None:
        raise OSError("the terminal is gone")

    stream = io.BytesIO(b"no JSON\n" + b"".join(map(drive, range(1, LOAD_BATCH + 2))))
    with pytest.raises(OSError, match="the terminal is gone"):
        load_stream(memory.writer, stream, refused_file=refused_file, refused=lambda line: None, progress=broken)
    assert refused_file.read_bytes() == b"no JSON\n"
    assert list(refused_file.parent.iterdir()) == [refused_file]


def test_the_refused_lines_of_an_earlier_load_stay_until_the_next_one_is_done(
    memory: Memory, refused_file: Path
) -> None:
    """Even that file itself can be loaded."""
    refused_file.write_bytes(b"no JSON\n" + drive(1))
    with refused_file.open("rb") as stream:
        report = load_stream(memory.writer, stream, refused_file=refused_file, refused=lambda line: None)
    assert (report.new, report.refused) == (1, 1)
    assert refused_file.read_bytes() == b"no JSON\n"


def test_the_refused_file_may_be_a_link(memory: Memory, refused_file: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(refused_file)
    load_stream(memory.writer, io.BytesIO(b"no JSON"), refused_file=link, refused=lambda line: None)
    assert (link.is_symlink(), refused_file.read_bytes()) == (True, b"no JSON\n")


@pytest.mark.parametrize("lines", [b"", drive(1)])
def test_the_refused_file_is_gone_when_nothing_was_refused(memory: Memory, refused_file: Path, lines: bytes) -> None:
    refused_file.write_text("left by an earlier load\n")
    load_stream(memory.writer, io.BytesIO(lines), refused_file=refused_file, refused=lambda line: None)
    assert not refused_file.exists()


def test_a_device_for_refused_lines_stays(memory: Memory, tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere"
    nowhere.symlink_to("/dev/null")
    for lines in (drive(1), b"no JSON"):
        load_stream(memory.writer, io.BytesIO(lines), refused_file=nowhere, refused=lambda line: None)
        assert nowhere.is_char_device()


def test_an_unwritable_refused_file_stops_the_load_before_it_begins(memory: Memory, tmp_path: Path) -> None:
    with pytest.raises(OSError, match="nowhere"):
        load_stream(
            memory.writer, io.BytesIO(drive(1)), refused_file=tmp_path / "nowhere" / "x", refused=lambda line: None
        )
    assert memory.recall().count() == 0


def test_a_folder_for_refused_lines_stops_the_load_before_it_begins(memory: Memory, tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError):
        load_stream(memory.writer, io.BytesIO(drive(1)), refused_file=tmp_path, refused=lambda line: None)
    assert memory.recall().count() == 0


def test_an_error_of_the_store_is_no_refusal(memory: Memory, refused_file: Path) -> None:
    memory.close()
    with pytest.raises(StoreClosed):
        load_stream(memory.writer, io.BytesIO(drive(1)), refused_file=refused_file, refused=lambda line: None)
    assert not refused_file.exists()


def test_types_are_read_from_lines() -> None:
    lines = [b'\xef\xbb\xbf{"type": "A"}\n', b"\n", b'{"type": "B", "parents": ["A"]}']
    assert read_types(lines) == [EventType(name="A"), EventType(name="B", parents=("A",))]


@pytest.mark.parametrize("line", [b"[]", b"{", b'{"parents": []}', b'{"type": ""}', b'{"type": "A", "is": 1}'])
def test_a_wrong_type_line_is_named_and_refuses_all(line: bytes) -> None:
    with pytest.raises(InvalidValue, match=r"^line 3: .*No type was added"):
        read_types([b'{"type": "A"}\n', b"\n", line])


def test_types_that_make_a_cycle_are_refused_by_the_memory(memory: Memory) -> None:
    types = read_types([b'{"type": "A", "parents": ["B"]}', b'{"type": "B", "parents": ["A"]}'])
    with pytest.raises(CycleRefused):
        memory.add_types(types)


def test_what_is_refused_can_be_loaded_again_once_it_is_mended(memory: Memory, refused_file: Path) -> None:
    keep: Callable[[RefusedLine], None] = lambda line: None  # noqa: E731
    load_stream(memory.writer, io.BytesIO(drive(1, type="Dance")), refused_file=refused_file, refused=keep)
    memory.add_type("Dance")
    with refused_file.open("rb") as stream:
        report = load_stream(memory.writer, stream, refused_file=refused_file.with_suffix(".again"), refused=keep)
    assert report.new == 1


def told_by_a_pipe(memory: Memory, tmp_path: Path, tell: Callable[[IO[bytes]], None], stop: Event) -> FileReport:
    """The load of what `tell` writes into a pipe, meanwhile."""
    read, write = os.pipe()
    with os.fdopen(read, "rb") as stream, os.fdopen(write, "wb", buffering=0) as source:
        teller = Thread(target=tell, args=(source,))
        teller.start()
        try:
            return load_stream(
                memory.writer,
                stream,
                refused_file=tmp_path / "refused.jsonl",
                refused=lambda line: None,
                stopped=stop.is_set,
            )
        finally:
            teller.join()


def soon(memory: Memory, count: int) -> bool:
    deadline = monotonic() + 60
    while memory.recall().count() != count and monotonic() < deadline:
        sleep(0.02)
    return memory.recall().count() == count


def test_a_source_that_makes_us_wait_finds_its_lines_kept_meanwhile(memory: Memory, tmp_path: Path) -> None:
    kept: list[bool] = []

    def tell(source: IO[bytes]) -> None:
        # The last line has not ended yet.
        source.write(drive(1) + b"no JSON\n" + drive(2) + drive(3)[:9])
        kept.append(soon(memory, 2))
        source.write(drive(3)[9:])
        kept.append(soon(memory, 3))
        source.write(b"no JSON\n" + drive(4).rstrip())
        source.close()

    report = told_by_a_pipe(memory, tmp_path, tell, Event())
    assert kept == [True, True]
    assert (report.read, report.new, report.refused) == (6, 4, 2)


def test_a_stop_keeps_what_was_read_and_does_not_wait_for_the_source(memory: Memory, tmp_path: Path) -> None:
    stop = Event()

    def tell(source: IO[bytes]) -> None:
        source.write(drive(1) + drive(2) + drive(3)[:9])
        assert soon(memory, 2)
        stop.set()

    report = told_by_a_pipe(memory, tmp_path, tell, stop)
    assert (report.read, report.new, report.refused) == (2, 2, 0)


def test_a_stop_ends_a_file_between_two_lines(memory: Memory, tmp_path: Path) -> None:
    file, asked = tmp_path / "events.jsonl", iter([False, False, True])
    file.write_bytes(drive(1) + drive(2) + drive(3))
    with file.open("rb") as stream:
        report = load_stream(
            memory.writer,
            stream,
            refused_file=tmp_path / "refused.jsonl",
            refused=lambda line: None,
            stopped=lambda: next(asked),
        )
    assert (report.read, report.new) == (2, 2)


def test_a_source_that_makes_us_wait_hears_of_refused_lines_alone(memory: Memory) -> None:
    told: list[int] = []

    def lines() -> Iterator[bytes | Waiting]:
        yield b"no JSON"
        yield Waiting()
        assert told == [1]
        yield b"no JSON"

    load_lines(memory.writer, lines(), refused=lambda line: told.append(line.number))
    assert told == [1, 2]
