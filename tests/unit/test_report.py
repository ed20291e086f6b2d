"""Tests of the report: rebuilt from the figures of small runs, with what is missing named, and of the plots' look."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from simulators.__main__ import main
from simulators.bench.markdown import duration, number, span, table
from simulators.paper.finished import beside
from tests.servers import Server

plots = pytest.importorskip("simulators.bench.plots", exc_type=ImportError)

SMALL = {
    "paper": ("--quick", "--runs", "1", "--components", "1"),
    "insert": ("--quick", "--events", "100"),
    "recall": ("--quick", "--events", "600", "--cues", "1"),
}
RUN = {
    "started": "2026-01-02T03:04:05+00:00",
    "machine": {"cpu": "Abacus", "cores": 2, "memory_gb": 1.5, "system": "Linux"},
    "versions": {"python": "3.11.2"},
    "settings": {"fsync": "on"},
    "commit": "0123456789abcdef",
    "options": {"quick": "False"},
    "seconds": 7300.0,
    "load_average": {"before": [0.5, 0.5, 0.5], "after": [1.5, 1.0, 0.5]},
}
BRIDGE = {"goals": {"read_vs_bare": {"value": 3.5, "goal": "<= 3", "met": False}}, "run": RUN}


@pytest.fixture(scope="module")
def measured(postgres_server: Server, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the figures of small runs."""
    directory = tmp_path_factory.mktemp("out")
    with postgres_server.database() as dsn:
        for name, arguments in SMALL.items():
            assert main([name, *arguments, "--dsn", dsn, "--json", str(directory / f"{name}.json")]) == 0
    return directory


@pytest.fixture(scope="module")
def text(measured: Path) -> str:
    """The report on them."""
    return text_of(measured)


def text_of(directory: Path, *arguments: str) -> str:
    assert main(["report", "--from", str(directory), *arguments]) == 0
    target = Path(arguments[1]) if arguments else directory / "report"
    return (target / "report.md").read_text(encoding="utf-8")


def written(directory: Path, name: str, figures: dict[str, Any]) -> Path:
    directory.mkdir(exist_ok=True)
    (directory / f"{name}.json").write_text(json.dumps(figures), encoding="utf-8")
    return directory


# The document


def test_the_report_has_a_section_with_pictures_for_each_file(measured: Path, text: str) -> None:
    headings = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert headings == ["Circumstances", "Goals", "The experiments of the paper", "Writing", "Recalling"]
    assert list(beside(measured / "paper.json").glob("*.json")), "finished runs are no figures"
    links = set(re.findall(r"\((pictures/[^)]*)\)", text))
    assert {link.rpartition(".")[2] for link in links} == {"png", "svg"}
    assert len(links) >= 2 * 7
    for link in links:
        assert (measured / "report" / link).stat().st_size > 1000, link
    found = json.loads((measured / "paper.json").read_text(encoding="utf-8"))
    mean = found["experiments"]["1"]["queries"]["ids"]["all"]["mean"]
    assert f"| one component: ids | 250 | {number(mean)} |" in text
    assert "| one component: published, VI-B2b |  | 145 | 412 | 13,500 | 14..589 | 78..776 |" in text
    assert "| published, VI-B2a and figure 7 |  | 19 | 110 | 8,200 |" in text
    assert "the ids of all events and then the events as objects, of more than 1,000 the first 1,000" in text
    assert "a quick run: too short to judge; " in text
    assert "fsync was off: nothing was durable" in text


def test_goals_are_told_as_met_or_missed(measured: Path, text: str) -> None:
    for name in SMALL:
        goals = json.loads((measured / f"{name}.json").read_text(encoding="utf-8"))["goals"]
        met = sum(goal["met"] for goal in goals.values())
        assert f"| {name}.json | {met} of {len(goals)} |" in text
        for figure, goal in goals.items():
            judged = "met" if goal["met"] else "**missed**"
            assert f"| `{figure}` | {number(goal['value'])} | {goal['goal']} | {judged} |" in text


def test_what_is_missing_is_named_with_its_command(measured: Path, text: str) -> None:
    assert f"- scale.json: `python -m simulators scale --json {measured / 'scale.json'}`" in text
    assert (
        f"- recognize.json: `make opponents; python -m simulators recognize --json {measured}/recognize.json`" in text
    )
    assert "- paper.json" not in text


def test_the_same_figures_make_the_same_section(measured: Path, text: str, tmp_path: Path) -> None:
    (tmp_path / "paper.json").write_bytes((measured / "paper.json").read_bytes())
    (section,) = re.findall(r"^## The experiments.*", text_of(tmp_path), re.MULTILINE | re.DOTALL)
    assert section in text + "\n"
    names = sorted(file.name for file in (tmp_path / "report" / "pictures").iterdir())
    assert len(names) == 2 * 4
    for name in names:
        first, second = (directory / "report" / "pictures" / name for directory in (measured, tmp_path))
        assert first.read_bytes() == second.read_bytes(), name


def test_circumstances_of_one_machine_stand_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    directory = written(tmp_path / "out", "bridge", BRIDGE)
    written(directory, "fields", BRIDGE | {"goals": {}})
    written(directory, "something-else", {"rows": 1})
    text = text_of(directory)
    assert "| bridge.json | 2026-01-02T03:04:05+00:00 | 2.0 h | 0123456789 | 0.5, 1.5 |  |" in text
    assert text.count("Abacus") == 1
    assert "**All files**: Abacus, 2 cores, 1.5 GB, Linux." in text
    assert "| bridge.json | 0 of 1 | `read_vs_bare` |" in text
    assert "| `read_vs_bare` | 3.5 | <= 3 | **missed** |" in text
    assert (
        "2 measurements, without paper, scale, opponents, insert, recall, recognize, types" in capsys.readouterr().out
    )


def test_what_to_doubt_is_said(tmp_path: Path) -> None:
    doubtful = RUN | {
        "commit": "0123456789abcdef-dirty",
        "settings": {"fsync": "off"},
        "load_average": {"before": [0.5, 1, 1], "after": [2.5, 1, 1]},
        "options": {"quick": "True", "seed": "1"},
    }
    directory = written(tmp_path / "out", "bridge", BRIDGE)
    text = text_of(written(directory, "doubtful", BRIDGE | {"run": doubtful}))
    doubts = (
        "a quick run: too short to judge; the machine was busy: load 2.5 on 2 cores; files differed from the commit"
    )
    assert f"| {doubts}; fsync was off: nothing was durable |" in text
    assert text.count("Abacus") == 2
    assert "Options: `quick=True seed=1`" in text


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("{", "is no JSON"),
        ('{"rows": 1}', "has no figures of a measurement"),
        (json.dumps(BRIDGE), r"insert\.json lacks what its section needs \(KeyError: 'load'\)"),
    ],
)
def test_files_that_cannot_be_read_are_one_line_on_stderr(
    content: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "insert.json").write_text(content, encoding="utf-8")
    assert main(["report", "--from", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert re.match(rf"simulators report: .*{reason}", said)
    assert not (tmp_path / "report" / "report.md").exists()


def test_without_any_figures_the_report_says_how_to_get_some(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", "--from", str(tmp_path / "none")]) == 1
    assert f"python -m simulators paper --json {tmp_path / 'none' / 'paper.json'}" in capsys.readouterr().err


def in_python(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


def test_the_report_needs_no_database(measured: Path, tmp_path: Path) -> None:
    (tmp_path / "insert.json").write_bytes((measured / "insert.json").read_bytes())
    done = in_python(
        "import sys; from simulators.__main__ import main; "
        f"code = main(['report', '--from', {str(tmp_path)!r}]); "
        "assert not {'psycopg', 'sqlalchemy'} & set(sys.modules); sys.exit(code)"
    )
    assert done.returncode == 0, done.stderr


def test_without_matplotlib_the_report_says_what_to_install(measured: Path) -> None:
    done = in_python(
        "import sys; sys.modules['matplotlib'] = None; from simulators.__main__ import main; "
        f"sys.exit(main(['report', '--from', {str(measured)!r}]))"
    )
    assert done.returncode == 1
    assert "pip install 'elm-memory[plot]'" in done.stderr
    assert "Traceback" not in done.stderr


# Its pieces


def test_numbers_are_short_and_have_no_exponent() -> None:
    shown = [number(value) for value in (None, 0, 2.0, 0.00123, 0.01234, 1.2345, 12.345, 123.45, 12345.6)]
    assert shown == ["-", "0", "2", "0.0012", "0.0123", "1.23", "12.3", "123", "12,346"]
    assert number(1.5, "ms") == "1.5 ms"
    assert span([3, None, 1.25, 2], "ms") == "1.25..3 ms"
    assert span([None]) == "-"
    assert [duration(seconds) for seconds in (0.4, 119, 120, 7199, 7200)] == [
        "0 s",
        "119 s",
        "2 min",
        "120 min",
        "2.0 h",
    ]


def test_a_table_keeps_its_cells_apart() -> None:
    assert table(("a", "b"), [["x|y", "1"]]) == "| a | b |\n| :-- | --: |\n| x\\|y | 1 |\n\n"


def test_a_plot_explains_each_series_once_and_no_error_bar_is_negative(tmp_path: Path) -> None:
    drawn, axes = plots.panels("title", ["left", "right"], "events", "ms", log="y")
    for each in axes:
        plots.limit(each, [1, 2], [0.5, 0.5], "limit")
        plots.line(each, [1, 2], [1.0, 4.0], "elm", spread=[3.0, 1.0])
    plots.write(drawn, tmp_path, "plot")
    (legend,) = drawn.legends
    assert [text.get_text() for text in legend.get_texts()] == ["elm", "limit"]
    ends = [
        (segment[0][1], segment[1][1])
        for lines in axes[0].collections
        for segment in lines.get_segments()
        if segment[0][0] == segment[1][0]
    ]
    assert ends == [(0.0, 4.0), (3.0, 5.0)]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["plot.png", "plot.svg"]


def test_bars_without_a_value_say_so(tmp_path: Path) -> None:
    drawn = plots.bars(
        ["a", "b"], {"elm": [1.0, None], "bare": [0.5, 0.25]}, "title", "ms", limit_label="bare", goal=2.0, log=True
    )
    (axes,) = drawn.axes
    assert [text.get_text() for text in axes.texts] == ["1", "cannot", "0.5", "0.25"]
    plots.write(drawn, tmp_path, "bars")
    assert [text.get_text() for text in drawn.legends[0].get_texts()] == ["elm", "bare", "goal 2"]
    greys = [patch.get_facecolor() for patch in axes.patches[2:]]
    assert greys == [plots.matplotlib.colors.to_rgba(plots.LIMIT)] * 2
