"""The pieces of the command line: options that become cues, groups of options, exit codes, and words for people."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import timedelta
from typing import Annotated, Any
from uuid import UUID

import pytest
import typer
from typer.testing import CliRunner

from elm import cues, errors
from elm.cli.cue_options import CueOptions, nearest_to
from elm.cli.event_table import contents, feature, lasting
from elm.cli.exits import ExitCode, exit_code, message
from elm.cli.naming import event_name
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import visible
from elm.cues.algebra import And, RegionCue
from elm.cues.relations import Place
from elm.errors import ElmError
from elm.event import Payload
from elm.geometry import Region
from elm.storage.diagnosis import masked
from tests.clock import at

BEGIN, END = "2026-01-01T10:00:00Z", "2026-01-01T10:00:09Z"


@pytest.mark.parametrize(
    ("options", "cue"),
    [
        (CueOptions(), And()),
        (CueOptions(exactly="A"), cues.exactly("A")),
        (CueOptions(is_a=["A", "B"]), cues.is_a("A") & cues.is_a("B")),
        (CueOptions(since=BEGIN), cues.time("intersects", at(0), None)),
        (CueOptions(until=END), cues.time("intersects", None, at(9))),
        (CueOptions(since=BEGIN, until=END), cues.time("intersects", at(0), at(9))),
        (CueOptions(agent="a", exactly="A"), cues.exactly("A") & cues.agent("a")),
        (CueOptions(feature=["n=7"]), cues.feature("n", "=", 7)),
        (CueOptions(feature=["n=7.5", "n=true"]), cues.feature("n", "=", 7.5) & cues.feature("n", "=", True)),
        (CueOptions(feature=['n="7"']), cues.feature("n", "=", "7")),
        (CueOptions(feature=["n=cup=blue"]), cues.feature("n", "=", "cup=blue")),
        (CueOptions(feature=["n="]), cues.feature("n", "=", "")),
        (CueOptions(feature=["n=null"]), cues.feature("n", "=", "null")),
        (CueOptions(feature=["n=[1]"]), cues.feature("n", "=", "[1]")),
        (CueOptions(cue=' {"op": "agent", "agent": "é"}'), cues.agent("é")),
    ],
)
def test_options_become_cues(options: CueOptions, cue: cues.Cue) -> None:
    assert options.read() == cues.all_of(cue)


@pytest.mark.parametrize(
    ("near", "inside", "outside"),
    [
        ("0,0,5", Region.box(5, -1, 6, 1), Region.box(5.01, -1, 6, 1)),
        ("-3.5,4e1,1", Region.box(-3, 40, -2, 41), Region.box(-2.4, 40, -2, 41)),
        ("1e8,-1e8,2", Region.box(100000002, -100000001, 100000003, -99999999), Region.box(0, 0, 1, 1)),
    ],
)
def test_near_reaches_to_its_metres(near: str, inside: Region, outside: Region) -> None:
    (found,) = CueOptions(near=near).read().args  # type: ignore[attr-defined]
    assert isinstance(found, RegionCue)
    assert found.distance is not None
    for region, expected in ((inside, True), (outside, False)):
        distance = found.region.distance(region)
        assert distance is not None
        assert (distance <= found.distance) is expected


def test_near_is_asked_of_the_subject_alike() -> None:
    (here,) = CueOptions(near="1,2,3,cellar").read().args  # type: ignore[attr-defined]
    (there,) = CueOptions(near_subject="1,2,3,cellar").read().args  # type: ignore[attr-defined]
    assert replace(there, place=here.place) == here
    assert (here.place, there.place) == (Place.REGION, Place.SUBJECT)


@pytest.mark.parametrize(("given", "frame"), [("3,-2", "map"), ("3,-2,floor 2, east", "floor 2, east")])
def test_the_nearest_are_those_to_a_point_of_a_frame(given: str, frame: str) -> None:
    found = nearest_to(given)
    assert found.place is Place.REGION
    assert found.to.frame == frame
    assert found.to.distance(Region.around(3, -2, 0.01, frame=frame)) == 0


@pytest.mark.parametrize("given", ["", "3", "3,", "x,2", "nan,2", "3,2,"])
def test_what_names_no_point_is_wrong_usage(given: str) -> None:
    with pytest.raises(typer.BadParameter):
        nearest_to(given)


def test_near_names_a_frame_with_any_characters() -> None:
    (found,) = CueOptions(near="1,2,3,floor 2, east").read().args  # type: ignore[attr-defined]
    assert found.region.frame == "floor 2, east"


@pytest.mark.parametrize(
    "options",
    [
        CueOptions(near="1,2"),
        CueOptions(near_subject="1,2"),
        CueOptions(near="1,2,x"),
        CueOptions(near="1,2,-3"),
        CueOptions(near="inf,2,3"),
        CueOptions(near="1,2,3,"),
        CueOptions(since="yesterday"),
        CueOptions(since="2026-01-01T10:00:00"),
        CueOptions(since=END, until=BEGIN),
        CueOptions(feature=["cup"]),
        CueOptions(feature=["=cup"]),
        CueOptions(feature=["n=99999999999999999999"]),
        CueOptions(exactly=""),
        CueOptions(agent="a\x00"),
        CueOptions(cue="{"),
        CueOptions(cue="{}"),
        CueOptions(cue='{"op": "agent", "agent": "\udcff"}'),
        CueOptions(cue="no/such/file"),
        CueOptions(cue="no\x00file"),
        CueOptions(cue='{"op": "not", "arg": ' * 1000 + '{"op": "and", "args": []}' + "}" * 1000),
    ],
)
def test_senseless_options_are_wrong_usage(options: CueOptions) -> None:
    with pytest.raises(typer.BadParameter) as refused:
        options.read()
    assert str(refused.value.message).isprintable()


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("17", 17),
        ("9223372036854775807", 2**63 - 1),
        ("00000000-0000-4000-8000-000000000001", UUID("00000000-0000-4000-8000-000000000001")),
        ("12345678123456781234567812345678", UUID("12345678-1234-5678-1234-567812345678")),
    ],
)
def test_events_are_named_by_id_or_uid(text: str, name: object) -> None:
    assert event_name(text) == name


@pytest.mark.parametrize("text", ["", "cup", "-1", "1.0", "9223372036854775808", "0" * 40, "٣"])
def test_other_names_of_events_are_wrong_usage(text: str) -> None:
    with pytest.raises(typer.BadParameter):
        event_name(text)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (("n", 7), "n=7"),
        (("n", 7.0), "n=7.0"),
        (("n", True), "n=true"),
        (("n", "cup"), "n=cup"),
        (("n", "7"), 'n="7"'),
        (("n", "true"), 'n="true"'),
        (("n", ""), "n="),
        (("n", '"7"'), r'n="\"7\""'),
    ],
)
def test_features_are_written_as_the_option_takes_them(given: tuple[str, Any], text: str) -> None:
    assert feature(given) == text
    assert CueOptions(feature=[text]).read() == cues.all_of(cues.feature(given[0], "=", given[1]))


@pytest.mark.parametrize(
    ("duration", "text"),
    [
        (None, "open"),
        (timedelta(), "0 s"),
        (timedelta(seconds=4.5), "4.5 s"),
        (timedelta(seconds=75.25), "0:01:15"),
        (timedelta(days=2, hours=3), "2 days, 3:00:00"),
    ],
)
def test_durations_in_words(duration: timedelta | None, text: str) -> None:
    assert lasting(duration) == text


def test_payloads_in_words() -> None:
    assert contents(None) == ["none"]
    assert contents(Payload(data=b"", media_type="a/b")) == ["a/b, 0 bytes"]
    assert contents(Payload(data=b"\xff\xfe", media_type="a/b")) == ["a/b, 2 bytes"]
    assert contents(Payload(data=b"hello", media_type="text/plain")) == ["text/plain, 5 bytes", "hello"]
    assert contents(Payload(data=b"x" * 5000))[1].endswith("x ...")


def test_control_characters_become_visible() -> None:
    assert visible("tab\t esc\x1b[1m c1\x9b bidi\u202e é 木 🤖") == r"tab\t esc\x1b[1m c1\x9b bidi\u202e é 木 🤖"


def every_error(root: type[Exception]) -> list[type[Exception]]:
    return [root, *(each for kind in root.__subclasses__() for each in every_error(kind))]


UNREACHABLE = {errors.DatabaseUnreachable, errors.ClusterError}


@pytest.mark.parametrize("kind", every_error(ElmError))
def test_every_error_has_an_exit_code_and_its_own_words(kind: type[Exception]) -> None:
    error = kind("what\n  to do")
    assert exit_code(error) == (ExitCode.UNREACHABLE if kind in UNREACHABLE else ExitCode.ERROR)
    assert message(error) == "what to do"


def test_errors_of_the_system_name_the_file() -> None:
    assert message(FileNotFoundError(2, "No such file or directory", "a.jsonl")) == "a.jsonl: No such file or directory"
    assert message(OSError(28, "No space left on device")) == "No space left on device"
    assert message(KeyError("x")).startswith("internal error: KeyError: 'x'. Please report")
    assert exit_code(KeyError("x")) == exit_code(OSError(28, "x")) == ExitCode.ERROR


@pytest.mark.parametrize(
    "dsn",
    [
        "postgresql://robot:geheim@host/db",
        "postgresql://robot@host/db?password=geheim",
        "host=h dbname=d password='geheim'",
        "host=h sslpassword=geheim",
        "postgresql://robot:geheim@host:port/db",
        "nonsense geheim",
    ],
)
def test_secrets_of_a_dsn_are_hidden(dsn: str) -> None:
    assert "geheim" not in masked(dsn)


def test_what_is_no_secret_of_a_dsn_is_shown() -> None:
    assert masked("postgresql://robot:geheim@host/db?port=5") == "user=robot password=*** dbname=db host=host port=5"
    assert masked("memory://") == "memory://"


@dataclass(frozen=True, kw_only=True)
class Colours:
    front: Annotated[str, typer.Option("--front", envvar="ELM_TEST_FRONT")] = "red"
    back: Annotated[list[str] | None, typer.Option("--back")] = None


def test_a_group_of_options_is_one_parameter() -> None:
    app = typer.Typer()
    seen: list[tuple[str, Colours, int]] = []

    @app.command()
    @takes_groups
    def paint(what: Annotated[str, typer.Argument()], colours: Colours, coats: int = 1) -> None:
        """Paint something."""
        seen.append((what, colours, coats))

    runner = CliRunner()
    assert runner.invoke(app, ["wall"]).exit_code == 0
    assert runner.invoke(app, ["door", "--back", "a", "--coats", "2", "--back", "b"]).exit_code == 0
    assert runner.invoke(app, ["door"], env={"ELM_TEST_FRONT": "blue"}).exit_code == 0
    assert seen == [
        ("wall", Colours(), 1),
        ("door", Colours(back=["a", "b"]), 2),
        ("door", Colours(front="blue"), 1),
    ]
    shown = runner.invoke(app, ["--help"]).output
    assert all(option in shown for option in ("--front", "--back", "--coats", "Paint something."))


def test_recognition_waits_alike_from_the_shell_and_from_python() -> None:
    from elm.cli.recognition_options import TimingOptions
    from elm.recognition import Timing

    assert TimingOptions().read() == Timing()
