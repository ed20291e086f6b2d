"""Tests of intervals, windows, the reading of times and Allen's thirteen relations."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from datetime import UTC, date, datetime, timedelta, timezone, tzinfo
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm.errors import ElmError, InvalidValue
from elm.interval import (
    MINUS_INFINITY,
    PLUS_INFINITY,
    AllenRelation,
    Interval,
    Window,
    as_utc,
    from_micros,
    parse_time,
    to_micros,
)
from tests.clock import at, span, window

MOMENTS = st.datetimes(timezones=st.just(UTC))


# Reading times


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2026-01-01T10:00:04.5Z", datetime(2026, 1, 1, 10, 0, 4, 500_000, tzinfo=UTC)),
        ("2026-01-01T10:00:04+00:00", datetime(2026, 1, 1, 10, 0, 4, tzinfo=UTC)),
        ("2026-01-01T10:00:04-00:00", datetime(2026, 1, 1, 10, 0, 4, tzinfo=UTC)),
        ("2026-01-01T12:00:00+02:00", datetime(2026, 1, 1, 10, tzinfo=UTC)),
        ("2026-01-01T00:30:00+05:45", datetime(2025, 12, 31, 18, 45, tzinfo=UTC)),
        ("0001-01-01T00:00:00Z", datetime(1, 1, 1, tzinfo=UTC)),
        ("9999-12-31T23:59:59.999999Z", datetime(9999, 12, 31, 23, 59, 59, 999_999, tzinfo=UTC)),
    ],
)
def test_an_rfc_3339_time_is_read_into_utc(text: str, expected: datetime) -> None:
    found = parse_time(text, what="a time")

    assert found == expected
    assert found.tzinfo is UTC


@pytest.mark.parametrize(
    ("text", "micros"),
    [
        ("2026-01-01T10:00:00.1234564Z", 123_456),
        ("2026-01-01T10:00:00.1234565Z", 123_456),
        ("2026-01-01T10:00:00.1234569Z", 123_456),
        ("2026-01-01T10:00:00.9999999Z", 999_999),
        ("2026-01-01T10:00:00.999999999Z", 999_999),
        ("2026-01-01T10:00:00.000000999Z", 0),
        ("1969-12-31T23:59:59.9999999Z", 999_999),
    ],
)
def test_digits_finer_than_a_microsecond_are_cut_and_never_rounded(text: str, micros: int) -> None:
    found = parse_time(text, what="a time")

    assert found.microsecond == micros
    assert found.second == int(text[17:19])


@pytest.mark.parametrize(
    "text",
    [
        "",
        "yesterday",
        "2026-13-01T00:00:00Z",
        "2026-02-29T00:00:00Z",
        "2026-01-01T25:00:00Z",
        "2026-01-01T10:00:60Z",
        "2026-01-01T10:00:00Z ",
        "2026-01-01T10:00:00+25:00",
        "infinity",
        "-infinity",
        "now",
    ],
)
def test_what_is_no_time_is_refused_by_name(text: str) -> None:
    with pytest.raises(InvalidValue, match="the begin of my interval"):
        parse_time(text, what="the begin of my interval")


@pytest.mark.parametrize("given", [None, 0, 1.5, True, [], {}, b"2026-01-01T10:00:00Z"])
def test_a_time_that_is_not_text_is_refused_by_name(given: object) -> None:
    with pytest.raises(InvalidValue, match="the begin of my interval"):
        parse_time(given, what="the begin of my interval")  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["2026-01-01T10:00:00", "2026-01-01", "2026-01-01T10:00"])
def test_a_time_without_zone_is_refused_as_naive_with_the_remedy(text: str) -> None:
    with pytest.raises(InvalidValue, match=r"naive.*2026-01-01T.*\+00:00"):
        parse_time(text, what="a time")


def test_rfc_3339_allows_small_letters() -> None:
    assert parse_time("2026-01-01t10:00:00z", what="a time") == datetime(2026, 1, 1, 10, tzinfo=UTC)


class _Unknown(tzinfo):
    """A zone that does not know its offset: by Python's rules such a datetime is naive."""

    def utcoffset(self, _: datetime | None) -> timedelta | None:
        return None

    def dst(self, _: datetime | None) -> timedelta | None:
        return None

    def tzname(self, _: datetime | None) -> str | None:
        return None


@pytest.mark.parametrize("naive", [datetime(2026, 1, 1, 10), datetime(2026, 1, 1, 10, tzinfo=_Unknown())])  # noqa: DTZ001
def test_naive_datetimes_are_refused_with_a_message_that_says_how_to_fix_it(naive: datetime) -> None:
    for build in (
        lambda: Interval(begin=naive, end=None),
        lambda: Interval(begin=at(-1e9), end=naive),
        lambda: Window(begin=naive),
        lambda: Window(end=naive),
        lambda: as_utc(naive, what="it"),
    ):
        with pytest.raises(InvalidValue, match=r"naive.*tzinfo=datetime\.UTC"):
            build()


@pytest.mark.parametrize("given", [None, 5, "2026-01-01T10:00:00Z", date(2026, 1, 1)])
def test_a_begin_that_is_no_datetime_is_refused(given: object) -> None:
    with pytest.raises(InvalidValue, match="the begin of an interval"):
        Interval(begin=given, end=None)  # type: ignore[arg-type]


class _Stamp(datetime):
    """A moment of a class of its own, as data frames have them, which may hold finer digits."""


def test_a_moment_of_a_derived_class_becomes_a_plain_datetime() -> None:
    stamp = _Stamp(2026, 1, 1, 10, tzinfo=UTC)

    assert type(Interval(begin=stamp, end=stamp).begin) is datetime
    assert type(Window(begin=stamp).begin) is datetime


def test_a_moment_before_year_1_in_utc_is_refused() -> None:
    early = datetime(1, 1, 1, tzinfo=timezone(timedelta(hours=14)))
    late = datetime(9999, 12, 31, 23, tzinfo=timezone(timedelta(hours=-14)))

    for moment in (early, late):
        with pytest.raises(InvalidValue, match="years 1 to 9999"):
            as_utc(moment, what="a time")


def test_the_two_readings_of_an_ambiguous_local_hour_stay_two_instants() -> None:
    berlin = ZoneInfo("Europe/Berlin")
    summer = datetime(2025, 10, 26, 2, 30, tzinfo=berlin, fold=0)
    winter = datetime(2025, 10, 26, 2, 30, tzinfo=berlin, fold=1)

    assert as_utc(summer, what="it") == datetime(2025, 10, 26, 0, 30, tzinfo=UTC)
    assert as_utc(winter, what="it") == datetime(2025, 10, 26, 1, 30, tzinfo=UTC)


def test_micros_are_exact_over_the_whole_calendar() -> None:
    assert to_micros(datetime(1970, 1, 1, tzinfo=UTC)) == 0
    assert to_micros(datetime(1970, 1, 1, 0, 0, 1, 1, tzinfo=UTC)) == 1_000_001
    assert to_micros(datetime(1969, 12, 31, 23, 59, 59, 999_999, tzinfo=UTC)) == -1
    assert to_micros(datetime(2000, 1, 1, tzinfo=UTC)) == 946_684_800_000_000
    assert to_micros(datetime(9999, 12, 31, 23, 59, 59, 999_999, tzinfo=UTC)) == 253_402_300_799_999_999


@given(MOMENTS)
def test_micros_and_back_is_the_same_instant_between_the_infinities(moment: datetime) -> None:
    assert from_micros(to_micros(moment)) == moment
    assert MINUS_INFINITY < to_micros(moment) < PLUS_INFINITY


# Intervals and windows


def test_an_interval_knows_whether_it_is_an_instant_or_still_open() -> None:
    instant, closed, still_open = Interval.at(at(1)), span(1, 3.5), Interval.since(at(1))

    assert (instant.is_instant, instant.is_open, instant.duration) == (True, False, timedelta(0))
    assert (closed.is_instant, closed.is_open, closed.duration) == (False, False, timedelta(seconds=2.5))
    assert (still_open.is_instant, still_open.is_open, still_open.duration) == (False, True, None)
    assert still_open.micros == (to_micros(at(1)), PLUS_INFINITY)
    assert closed.micros == (to_micros(at(1)), to_micros(at(3.5)))


def test_an_end_before_the_begin_is_refused_even_by_a_microsecond() -> None:
    with pytest.raises(InvalidValue, match=r"ends .* before it begins"):
        span(1, 0.999999)
    with pytest.raises(InvalidValue, match=r"ends .* before it begins"):
        window(1, 0.999999)


def test_end_before_begin_is_judged_in_utc_not_by_the_clock_face() -> None:
    east, west = timezone(timedelta(hours=2)), timezone(timedelta(hours=-2))

    earlier = datetime(2026, 1, 1, 11, tzinfo=east)
    later = datetime(2026, 1, 1, 8, tzinfo=west)
    assert Interval(begin=earlier, end=later).duration == timedelta(hours=1)
    with pytest.raises(InvalidValue):
        Interval(begin=later, end=earlier)


def test_intervals_are_equal_whatever_zone_they_were_written_in() -> None:
    east = timezone(timedelta(hours=2))
    written_east = Interval(begin=at(0).astimezone(east), end=at(5).astimezone(east))

    assert written_east == span(0, 5)
    assert hash(written_east) == hash(span(0, 5))
    assert written_east.begin.tzinfo is UTC
    assert span(0, 5) != span(0, None)


def test_intervals_and_windows_are_frozen_and_keyword_only() -> None:
    with pytest.raises(FrozenInstanceError):
        span(0, 5).begin = at(1)  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        window(0, 5).begin = at(1)  # type: ignore[misc]
    with pytest.raises(TypeError):
        Interval(at(0), at(5))  # type: ignore[call-arg]


def test_a_window_without_bound_reaches_to_infinity() -> None:
    assert window(None, None).micros == (MINUS_INFINITY, PLUS_INFINITY)
    assert window(0, None).micros == (to_micros(at(0)), PLUS_INFINITY)
    assert window(None, 0).micros == (MINUS_INFINITY, to_micros(at(0)))
    assert Window.of(span(0, None)) == window(0, None)
    assert Window.of(span(0, 5)) == window(0, 5)


def test_an_interval_is_shown_with_both_ends() -> None:
    assert str(span(0, 4.5)) == "[2026-01-01T10:00:00+00:00, 2026-01-01T10:00:04.500000+00:00]"
    assert str(span(0, None)) == "[2026-01-01T10:00:00+00:00, ...]"


# Allen's relations

PROPER = st.tuples(st.integers(0, 6), st.integers(1, 4)).map(lambda drawn: (drawn[0], drawn[0] + drawn[1]))
ANY = st.tuples(st.integers(0, 6), st.integers(0, 4)).map(lambda drawn: (drawn[0], drawn[0] + drawn[1]))
CONVERSE = {
    "before": "after",
    "meets": "met_by",
    "overlaps": "overlapped_by",
    "starts": "started_by",
    "during": "contains",
    "finishes": "finished_by",
    "equals": "equals",
}


def _held(event: tuple[int, int], given_window: tuple[int, int]) -> set[str]:
    return {relation.value for relation in AllenRelation if relation.holds(event, given_window)}


def test_there_are_the_thirteen_relations() -> None:
    assert {relation.value for relation in AllenRelation} == {*CONVERSE, *CONVERSE.values()}
    assert len(AllenRelation) == 13


@pytest.mark.parametrize(
    ("event", "expected"),
    [
        ((0, 5), {"before"}),
        ((0, 10), {"meets"}),
        ((5, 15), {"overlaps"}),
        ((10, 15), {"starts"}),
        ((12, 18), {"during"}),
        ((15, 20), {"finishes"}),
        ((10, 20), {"equals"}),
        ((10, 25), {"started_by"}),
        ((5, 25), {"contains"}),
        ((5, 20), {"finished_by"}),
        ((15, 25), {"overlapped_by"}),
        ((20, 25), {"met_by"}),
        ((25, 30), {"after"}),
        # Instants may stand in several relations at once.
        ((10, 10), {"meets", "starts"}),
        ((20, 20), {"met_by", "finishes"}),
        ((15, 15), {"during"}),
        # Still going on.
        ((15, PLUS_INFINITY), {"overlapped_by"}),
        ((10, PLUS_INFINITY), {"started_by"}),
        ((5, PLUS_INFINITY), {"contains"}),
        ((20, PLUS_INFINITY), {"met_by"}),
        ((25, PLUS_INFINITY), {"after"}),
    ],
)
def test_relations_to_the_window_from_10_to_20(event: tuple[int, int], expected: set[str]) -> None:
    assert _held(event, (10, 20)) == expected


def test_an_instant_against_the_same_instant_equals_meets_and_is_met() -> None:
    assert _held((15, 15), (15, 15)) == {"equals", "meets", "met_by"}


@given(PROPER, PROPER)
def test_between_proper_intervals_exactly_one_relation_holds(event: tuple[int, int], other: tuple[int, int]) -> None:
    assert len(_held(event, other)) == 1


@given(ANY, ANY)
def test_a_relation_one_way_is_its_converse_the_other_way(event: tuple[int, int], other: tuple[int, int]) -> None:
    both_ways = {**CONVERSE, **{there: here for here, there in CONVERSE.items()}}

    assert {both_ways[name] for name in _held(event, other)} == _held(other, event)
    assert _held(event, other)


def test_all_refusals_have_the_one_root() -> None:
    with pytest.raises(ElmError):
        parse_time("never", what="a time")
    with pytest.raises(ValueError, match="never"):
        parse_time("never", what="a time")


def test_the_time_of_pandas_that_is_none_is_refused() -> None:
    pandas = pytest.importorskip("pandas")
    with pytest.raises(InvalidValue, match="NaT, which is no time"):
        Interval.at(pandas.NaT)
    with pytest.raises(InvalidValue, match="the end of an interval is NaT"):
        Interval(begin=at(0), end=pandas.NaT)


def test_what_is_no_datetime_is_told_how_to_make_one() -> None:
    numpy = pytest.importorskip("numpy")
    with pytest.raises(InvalidValue, match=r"datetime64.*pandas.Timestamp"):
        Interval.at(numpy.datetime64("2026-01-01"))
