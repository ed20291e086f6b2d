"""Commands on the empty memory of their own process: no database is needed, or looked for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from elm.app import connect
from elm.cli.program import app
from elm.errors import InvalidValue


@pytest.fixture(autouse=True)
def _no_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing here may come upon a cluster or database of whoever runs the tests."""
    monkeypatch.setenv("ELM_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("ELM_DSN", raising=False)
    monkeypatch.delenv("ELM_MEMORY", raising=False)
    monkeypatch.chdir(tmp_path)


def elm(*arguments: str, stdin: str | None = None) -> Result:
    return CliRunner().invoke(app, [*arguments, "--dsn", "memory://"], input=stdin, prog_name="elm")


@pytest.mark.parametrize(
    ("arguments", "code", "printed"),
    [
        (("count",), 0, "0\n"),
        (("count", "-o", "jsonl"), 0, '{"count":0}\n'),
        (("count", "--by", "type"), 0, ""),
        (("recall",), 4, ""),
        (("recall", "-o", "table"), 4, ""),
        (("recall", "-o", "geojson"), 4, '{"type": "FeatureCollection", "features": [\n]}\n'),
        (("show", "1"), 4, ""),
        (("tree", "1"), 1, ""),
        (("types", "tree"), 0, ""),
        (("types", "tree", "-o", "table"), 0, ""),
        (("export",), 0, ""),
        (("migrate",), 0, ""),
    ],
)
def test_an_empty_memory(arguments: tuple[str, ...], code: int, printed: str) -> None:
    done = elm(*arguments)
    assert (done.exit_code, done.stdout) == (code, printed), done.output


def test_an_empty_dsn_is_a_mistake_and_not_the_private_cluster(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["types", "add", "Drive", "--dsn", ""], prog_name="elm")
    assert done.exit_code == 1
    assert "empty DSN" in done.stderr
    with pytest.raises(InvalidValue, match="empty DSN"):
        connect("")
    assert not (tmp_path / "home").exists()


def test_statistics_of_nothing() -> None:
    known = json.loads(elm("stats").stdout)
    assert (known["memory"], known["events"], known["first_begin"], known["bytes"]) == ("elm", 0, None, None)
    assert "none" in elm("stats", "-o", "table").stdout


def test_types_are_added() -> None:
    assert elm("types", "add", "Drive").stderr.startswith("added 1 types")
    assert elm("types", "load", "-", stdin='{"type": "B", "parents": ["A"]}\n{"type": "A"}').stderr.startswith(
        "added 2 types and 1 is-a links"
    )
    assert elm("types", "add", "Drive", "Motion").exit_code == 1


def test_types_load_wants_one_source(tmp_path: Path) -> None:
    (tmp_path / "words.tsv").write_text("id\tparents\tinstance_of\tlemmas\na\t\t\tx\nb\ta\t\ty\n")
    assert elm("types", "load", "--wordnet", "words.tsv").stderr.startswith("added 2 types and 1 is-a links")
    for arguments in ((), ("-", "--wordnet", "words.tsv")):
        assert elm("types", "load", *arguments).exit_code == 2


def test_an_explanation_of_nothing() -> None:
    done = elm("recall", "--agent", "a", "--explain", "-o", "table")
    assert done.exit_code == 0
    assert '{"op":"agent","agent":"a"}' in done.stdout


def test_doctor() -> None:
    done = elm("doctor", "--memory", "mine")
    assert done.exit_code == 0
    for name in ("elm: ", "Python: ", "system: ", "private cluster: "):
        assert f"\n{name}" in f"\n{done.stdout}"


def test_without_arguments_there_is_help() -> None:
    done = CliRunner().invoke(app, [], prog_name="elm")
    assert "recall" in done.output
    assert "doctor" in done.output


def test_the_memory_is_named_by_option_or_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ELM_MEMORY", "ours")
    assert json.loads(elm("stats").stdout)["memory"] == "ours"
    assert json.loads(elm("stats", "--memory", "mine").stdout)["memory"] == "mine"
    monkeypatch.setenv("ELM_DSN", "memory://")
    assert CliRunner().invoke(app, ["count"]).stdout == "0\n"
