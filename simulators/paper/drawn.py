"""Figures 7 and 8 of the paper as this machine draws them, all classes of cues, and the tables beside its numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import duration, number, span, table
from simulators.paper.published import CLASS_MEANS, CLASS_SDS, INSERTION, RETRIEVAL, SOURCE, Published
from simulators.paper.schedule import EXPERIMENTS, INSERTIONS, QUERIES, Answer
from simulators.worlds.queries import CLASSES

SUB_TYPES = "type.is_a"
"""The class that figure 8 is about."""

_NAMES = {str(components): name for components, name in EXPERIMENTS.items()}
_HEAD = ("ms", "calls", "mean", "sd", "max")
_CLASS_HEAD = (
    "class",
    "queries",
    "mean",
    "sd",
    "max",
    "mean rows",
    "last / second tenth",
    "bare fetch",
    "published mean",
    "published sd",
    "mean, all as objects",
)


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `paper`; draws into the directory `pictures`."""
    return "".join(_paragraphs(figures, pictures))


def _paragraphs(figures: Mapping[str, Any], pictures: Path) -> Iterator[str]:
    experiments = figures["experiments"]
    runs = ", ".join(
        f"{experiment['runs']} with {_NAMES[components]}" for components, experiment in experiments.items()
    )
    yield (
        f"Section VI-B of the paper again, runs: {runs}. Each begins with an empty memory, {INSERTIONS} insertions and "
        f"{QUERIES} queries take turns up to {figures['events']:,} events. An insertion is one durable "
        f"`memory.commit`. sd is the sample standard deviation over single calls. Published: {SOURCE}.\n\n"
    )
    yield "### Insertion\n\n"
    yield table((*_HEAD, "last / second tenth", "against the bare insert"), _insertion_rows(figures))
    yield plots.picture(_figure_7(figures, pictures), "Insertion of events, as figure 7 of the paper") + "\n\n"
    yield "### Retrieval\n\n"
    yield _about_answers(figures)
    yield table(
        (*_HEAD, "class means", "class sds", "mean rows", "last / second tenth", "against the bare fetch"),
        _retrieval_rows(experiments),
    )
    yield "\n".join(_longest(experiments)) + "\n\n"
    yield plots.picture(_all_queries(figures, pictures), "Retrieval, all queries, by the size of the memory") + "\n\n"
    if "1" in experiments and SUB_TYPES in _main(experiments["1"])["classes"]:
        yield plots.picture(_figure_8(figures, pictures), "Retrieval by type or sub-type, as figure 8") + "\n\n"
    yield "### Classes of cues\n\n"
    yield plots.picture(_overview(figures, pictures), "Mean time of each class of cues") + "\n\n"
    for components, experiment in experiments.items():
        yield f"Cues of {_NAMES[components]}, in ms:\n\n"
        yield table(_CLASS_HEAD, _class_rows(experiment, known=components == "1"))
    yield "### Runs\n\n"
    yield table(("run", "begun", "took", "load average before, after"), _run_rows(figures["runs"]))


def _about_answers(figures: Mapping[str, Any]) -> str:
    answers = {answer for experiment in figures["experiments"].values() for answer in experiment["queries"]}
    words = (
        "Cues are made of events drawn from all that are stored, nine in ten of them atomic: the sets of their parts "
        "are empty, and some classes ask for most of the memory. "
    )
    if Answer.IDS in answers:
        words += (
            "Answers are therefore read as the ids of all events and then the events as objects, of more than 1,000 "
            "the first 1,000 (`ids`). "
        )
    if Answer.OBJECTS in answers:
        words += "In the first run of each experiment all events are read as objects instead (`objects`). "
    return words + (
        "A query of several components counts for each of their classes. The limit is a bare fetch of up to 1,000 of "
        "the same rows by their ids, prepared, after every tenth query; the ratio is that of the means where it "
        "fetched all of them.\n\n"
    )


def _insertion_rows(figures: Mapping[str, Any]) -> Iterator[list[str]]:
    yield [f"published, {INSERTION.place}", "", *_known(INSERTION), "", ""]
    found = figures["insertion"]
    yield ["all runs", *_measured(found), number(found["growth"]), number(found["vs_bare"])]
    for components, experiment in figures["experiments"].items():
        own = experiment["insertion"]
        yield [f"runs with {_NAMES[components]}", *_measured(own), number(own["growth"]), number(own["vs_bare"])]
    yield ["limit: bare insert + commit", *_measured(found["bare"]), number(found["bare"]["growth"]), ""]


def _retrieval_rows(experiments: Mapping[str, Any]) -> Iterator[list[str]]:
    for components, experiment in experiments.items():
        known = RETRIEVAL[int(components)]
        ends = [span(values or ()) for values in (known.class_means, known.class_sds)]
        yield [f"{_NAMES[components]}: published, {known.place}", "", *_known(known), *ends, "", "", ""]
        for answer, asked in experiment["queries"].items():
            every, classes = asked["all"], asked["classes"].values()
            yield [
                f"{_NAMES[components]}: {answer}",
                *_measured(every),
                span(found["mean"] for found in classes),
                span(found["sd"] for found in classes),
                number(every["rows"]),
                number(every["growth"]),
                number(every["vs_fetch"]),
            ]


def _longest(experiments: Mapping[str, Any]) -> Iterator[str]:
    for components, experiment in experiments.items():
        for answer, asked in experiment["queries"].items():
            query = asked["longest"]
            yield (
                f"- Longest with {_NAMES[components]}, `{answer}`: {number(query['ms'], 'ms')} for "
                f"`{' & '.join(query['classes'])}`, {query['rows']:,} rows of {query['events']:,} events."
            )


def _class_rows(experiment: Mapping[str, Any], *, known: bool) -> Iterator[list[str]]:
    objects = experiment["queries"].get(Answer.OBJECTS, {"classes": {}})["classes"]
    for name in CLASSES:
        found = _main(experiment)["classes"].get(name)
        if found is None:
            continue
        yield [
            f"`{name}`",
            *_measured(found),
            number(found["rows"]),
            number(found["growth"]),
            number(found["fetch"]["mean"] if found["fetch"]["count"] else None),
            number(CLASS_MEANS.get(name) if known else None),
            number(CLASS_SDS.get(name) if known else None),
            number(objects[name]["mean"] if name in objects else None),
        ]


def _run_rows(runs: Iterable[Mapping[str, Any]]) -> Iterator[list[str]]:
    for run in runs:
        load = ", ".join(f"{run['load_average'][when][0]:g}" for when in ("before", "after"))
        yield [run["name"], run["started"], duration(run["seconds"]), load]


def _known(found: Published) -> list[str]:
    return [number(found.mean), number(found.sd), number(found.max)]


def _measured(found: Mapping[str, Any]) -> list[str]:
    return [f"{found['count']:,}", *(number(found[name]) for name in ("mean", "sd", "max"))]


def _main(experiment: Mapping[str, Any]) -> Mapping[str, Any]:
    """The runs that most are like: those that read ids, where there are any."""
    queries = experiment["queries"]
    found: Mapping[str, Any] = queries[Answer.IDS if Answer.IDS in queries else Answer.OBJECTS]
    return found


def _figure_7(figures: Mapping[str, Any], pictures: Path) -> Path:
    components, experiment = next(iter(figures["experiments"].items()))
    found = experiment["insertion"]["by_size"]
    drawn, axes = plots.figure("Insertion of events (figure 7)", "events in the memory", "ms", log="y")
    runs = "one run" if experiment["runs"] == 1 else f"each of {experiment['runs']} runs"
    label = f"elm: mean and sd, {figures['step']:,} insertions in {runs}"
    plots.line(axes, found["size"], found["mean"], label, spread=_spread(found["sd"]))
    plots.limit(axes, *_both(found["size"], found["bare_mean"]), "limit: bare insert + commit, mean")
    plots.level(axes, INSERTION.mean, f"published: mean {INSERTION.mean:g} ms, sd about {INSERTION.sd:g} ms")
    axes.set_title(f"durable, one by one, in the runs with cues of {_NAMES[components]}", size=10, color=plots.MUTED)
    return plots.write(drawn, pictures, "paper-figure-7")


def _figure_8(figures: Mapping[str, Any], pictures: Path) -> Path:
    asked = _main(figures["experiments"]["1"])
    found = asked["classes"][SUB_TYPES]["by_size"]
    drawn, axes = plots.figure(
        "Retrieval based on event type, including sub-types (figure 8)", "events in the memory", "ms", log="y"
    )
    each = sum(found["count"]) / len(found["count"])
    plots.line(
        axes, found["size"], found["mean"], f"elm: mean and sd of {each:,.0f} queries on average",
        spread=_spread(found["sd"]),
    )  # fmt: skip
    plots.limit(axes, *_both(found["size"], found["fetch_mean"]), "limit: bare fetch of rows sampled, mean")
    plots.level(
        axes, CLASS_MEANS[SUB_TYPES], f"published: mean over all sizes {CLASS_MEANS[SUB_TYPES]:g} ms, growing linearly"
    )
    return plots.write(drawn, pictures, "paper-figure-8")


def _all_queries(figures: Mapping[str, Any], pictures: Path) -> Path:
    experiments = figures["experiments"]
    drawn, row = plots.panels(
        "Retrieval, all queries",
        [_NAMES[components] for components in experiments],
        "events in the memory",
        "ms",
        log="y",
        size=(3.0 + 3.0 * len(experiments), 4.4),
    )
    for axes, (components, experiment) in zip(row, experiments.items(), strict=True):
        for place, answer in enumerate((Answer.IDS, Answer.OBJECTS)):
            if answer in experiment["queries"]:
                found = experiment["queries"][answer]["all"]["by_size"]
                label = f"elm, read as {answer}: mean"
                plots.line(axes, found["size"], found["mean"], label, number=place)
        found = _main(experiment)["all"]["by_size"]
        plots.limit(axes, *_both(found["size"], found["fetch_mean"]), "limit: bare fetch of up to 1,000 rows, mean")
        plots.level(axes, RETRIEVAL[int(components)].mean, "published: mean over all sizes")
    return plots.write(drawn, pictures, "paper-retrieval")


def _overview(figures: Mapping[str, Any], pictures: Path) -> Path:
    means = {
        _NAMES[components]: [_main(experiment)["classes"].get(name, {}).get("mean") for name in CLASSES]
        for components, experiment in figures["experiments"].items()
    }
    components, first = next(iter(figures["experiments"].items()))
    limit = f"limit: bare fetch of up to 1,000 rows, {_NAMES[components]}"
    found = [_main(first)["classes"].get(name, {}).get("fetch", {"count": 0}) for name in CLASSES]
    drawn = plots.bars(
        CLASSES,
        {**means, limit: [each["mean"] if each["count"] else None for each in found]},
        "Mean time of a query, by the classes of its components",
        "ms",
        log=True,
        limit_label=limit,
        missing="not asked",
    )
    return plots.write(drawn, pictures, "paper-classes")


def _spread(values: list[float | None]) -> list[float]:
    return [value or 0.0 for value in values]


def _both(sizes: list[int], values: list[float | None]) -> tuple[list[int], list[float]]:
    """The sizes at which there is a value, and these values."""
    known = [(size, value) for size, value in zip(sizes, values, strict=True) if value is not None]
    return [size for size, _ in known], [value for _, value in known]
