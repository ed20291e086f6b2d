"""Soar: the episodic memory of its agents, which records what is in working memory and is cued with a part of it.

An event comes in by the agent's input link for one decision, and becomes one episode, in a file of SQLite. A cue
is a structure whose leaves are to be found again: equal symbols, no ranges, no geometry. So what an event has
several of (kinds of its type, features, their names, parts) becomes as many symbols. Soar answers with the best
matching episode, the most recent of several; three rules show it on the output link. More than one is fetched by
asking again, before the last one found, until one does not match fully: each costs three decisions of the agent.
What is to be absent is said by a negative cue, which must list it: all other names of features that there are.

All is one transaction until the store is closed. It could be made durable in two ways that nobody would use: to close
it after each event, or to set `lazy-commit off`, which has no transactions at all (each of an episode's two hundred
statements is flushed to the disk by itself, retrievals write too, and a power cut leaves half an episode). Both took
0.1 to 0.3 s an event where the others took 1 to 5 ms, so there is no durable mode here.
"""

from __future__ import annotations

import json
from base64 import b64decode, b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import shapely
import soar_sml

from simulators.opponents.protocol import KINDS, Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.exact import Facts, fitting
from simulators.opponents.sides.spelling import token

Cue = Mapping[str, Sequence[str | int]]
"""Symbols by attribute, all of which an event is to have."""

_SETTINGS = (
    # Without this an agent that has nothing to do goes down into one sub-state after the other.
    "soar wait-snc on",
    "output warnings off",
    "trace 0",
    "epmem --set database file",
    "epmem --set optimization safety",
    "epmem --set lazy-commit on",
    "epmem --set trigger dc",
    "epmem --enable",
)
_RULES = (
    """sp {ask
    (state <s> ^io.input-link.ask <a> ^epmem.command <c>) (<a> ^{ << query neg-query before >> <part> } <value>)
    --> (<c> ^<part> <value>)}""",
    """sp {found
    (state <s> ^epmem.result <r> ^io.output-link <o>)
    (<r> ^memory-id <number> ^normalized-match-score <score> ^retrieved.io.input-link.event <e>)
    --> (<o> ^found <f>) (<f> ^number <number> ^score <score> ^event <e>)}""",
    """sp {nothing
    (state <s> ^epmem.result.failure <f> ^io.output-link <o>)
    --> (<o> ^nothing <n>) (<n> ^cue <f>)}""",
    # Where no event was seen a negative cue fits best.
    """sp {nothing-seen
    (state <s> ^epmem.result.retrieved <r> ^io.output-link <o>) -(<r> ^io.input-link.event)
    --> (<o> ^nothing <n>) (<n> ^cue <r>)}""",
)
_COMMIT = ("epmem --close", "epmem --set append on")
"""The store opens by itself again, with what it has."""
_PATIENCE = 10
"""Decisions within which an answer has come."""
_FORGETTING = 2
"""Decisions after which nothing of an answer is left."""
_NO_RANGES = "cues are equal symbols: no ranges"
_NO_PLACES = "cues are equal symbols: no geometry"
_MANY = "one episode per retrieval, and the answer is a large part of the memory"
_NO_WHOLES = "an episode cannot be told later what it became part of"


class SoarSide:
    """An agent that does nothing but see, record and be asked."""

    name = "soar_side"
    title = "Soar epmem"
    why = (
        "Made to find the one best episode within an agent's own process, which takes it about as long as elm a "
        "statement; every further row is another retrieval, so that answers of many rows take many times elm's, "
        "and it knows neither ranges nor places."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "relaxed": "one transaction until the store is closed, as at the end of a load: a crash of the process "
            "loses all events before"
        }
    )
    abilities = everything_but(
        {
            **dict.fromkeys(("time.subset", "time.superset", "time.intersects", "window"), _NO_RANGES),
            **dict.fromkeys((kind for kind in KINDS if kind.startswith(("region.", "near"))), _NO_PLACES),
            **dict.fromkeys(("parts.subset", "feature_names.intersects"), _MANY),
            "wholes.subset": _NO_WHOLES,
        },
        filtered=[
            *(kind for kind in KINDS if kind.startswith("wholes.") and kind != "wholes.subset"),
            *("features.subset", "features.intersects"),
            *("parts.equal", "parts.intersects", "type.latest"),
        ],
    )

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        self._kernel = soar_sml.Kernel.CreateKernelInCurrentThread(True, 0)
        self._agent = self._kernel.CreateAgent("memory")
        self._do(f"epmem --set path {directory / 'episodes.db'}", *_SETTINGS, *_RULES)
        self._input = self._agent.GetInputLink()
        self._records = True
        self._kinds = workload.closure
        self._names: set[str] = set()

    def version(self) -> str:
        """Soar's."""
        return str(self._kernel.GetSoarKernelVersion())

    def commit(self, record: Record) -> object:
        """Have the event on the input link for one decision, at whose end it is an episode."""
        self._recording(True)
        event = self._input.CreateIdWME("event")
        for name, value in self._symbols(record):
            _add(event, name, value)
        self._agent.RunSelf(1)
        return event.DestroyWME()

    def load(self, records: Sequence[Record]) -> object:
        """See one after the other, which is the only way in, and commit."""
        for record in records:
            self.commit(record)
        self._do(*_COMMIT)
        return None

    def ask(self, question: Question) -> Sequence[Facts]:
        """Events as mappings, made of what the output link shows."""
        self._recording(False)
        value = question.value
        field, _, relation = question.kind.partition(".")
        if field in ("parts", "wholes") and not value:
            raise ValueError("Soar has no cue for what has no parts, or no wholes")
        match field:
            case "type":
                return self._fitting(question, self._all("kind" if relation == "is_a" else "type", [value]))
            case "payload":
                return self._fitting(question, self._all("payload", [b64encode(bytes.fromhex(value)).decode()]))
            case "time":
                return self._fitting(question, self._episodes({"begin": [value["begin"]], "end": [value["end"]]}))
            case "parts":
                return self._with(question, "part", relation, value)
            case "features":
                return self._with(question, "feature", relation, [token(*feature) for feature in value])
            case "feature_names":
                return self._with(question, "name", relation, value)
            case "wholes":
                return self._parts_of(question, relation)
            case other:
                raise ValueError(f"Soar cannot be asked for {other}")

    def uid_of(self, row: Facts) -> str:
        """Its uid."""
        return str(row["uid"])

    def close(self) -> None:
        """End the agent, which commits."""
        self._kernel.Shutdown()

    def _do(self, *commands: str) -> None:
        for command in commands:
            answer = self._agent.ExecuteCommandLine(command)
            if not self._agent.GetLastCommandLineResult():
                raise ValueError(f"Soar refuses {command.strip()!r:.60}: {answer}")

    def _recording(self, wanted: bool) -> None:
        """Whether decisions become episodes: those that are about a question do not."""
        if wanted != self._records:
            # What the output link still shows of an answer is no part of the next episode.
            self._agent.RunSelf(_FORGETTING)
            self._do(f"epmem --set trigger {'dc' if wanted else 'none'}")
            self._records = wanted

    def _symbols(self, record: Record) -> Iterator[tuple[str, str | int]]:
        """What an event is to the agent: symbols to be found by, and JSON where order and exact values count."""
        names = {name for name, _ in record.features}
        self._names |= names
        several = {
            "kind": self._kinds[record.type],
            "feature": {token(name, value) for name, value in record.features},
            "name": names,
            "part": set(record.parts),
        }
        for name, values in several.items():
            yield from ((name, value) for value in values)
        yield from (("begin", record.begin), ("end", record.end), ("number", record.number))
        yield from (("uid", record.uid), ("type", record.type), ("agent", record.agent))
        # All events have it, for cues that otherwise only say what is to be absent.
        yield "is", "event"
        yield "feature-set", json.dumps(sorted(several["feature"]))
        yield "name-set", json.dumps(sorted(names))
        yield "payload", b64encode(record.payload).decode()
        yield "media_type", json.dumps(record.media_type)
        yield "features", json.dumps(record.features)
        yield "parts", json.dumps(record.parts)
        yield "region", "none" if record.ring is None else shapely.Polygon(record.ring).wkb_hex

    def _fitting(self, question: Question, rows: Iterable[Facts]) -> list[Facts]:
        unique = {row["number"]: row for row in rows}
        return fitting(question, unique.values(), lambda row: row, self._kinds)

    def _with(self, question: Question, symbol: str, relation: str, values: Sequence[str]) -> list[Facts]:
        """Events with all of the symbols, with some, or with no others."""
        wanted = sorted(set(values))
        if relation == "equal" and symbol != "part":
            return self._fitting(question, self._all(f"{symbol}-set", [json.dumps(wanted)]))
        if relation == "intersects":
            return self._fitting(question, (row for value in wanted for row in self._all(symbol, [value])))
        if relation == "subset":
            known = {json.loads(value)[0] for value in wanted} if symbol == "feature" else set(wanted)
            return self._fitting(question, self._episodes({"is": ["event"]}, {"name": sorted(self._names - known)}))
        return self._fitting(question, self._all(symbol, wanted))

    def _parts_of(self, question: Question, relation: str) -> list[Facts]:
        """The events that those of the wholes name as their parts, looked up one by one."""
        wholes = set(question.value)
        parts = [set(whole["parts"]) for uid in wholes for whole in self._all("uid", [uid])]
        wanted = set.union(*parts) if relation == "intersects" else set.intersection(*parts)
        rows = [row for uid in wanted for row in self._all("uid", [uid])]
        if relation == "equal":
            rows = [row for row in rows if {whole["uid"] for whole in self._all("part", [row["uid"]])} == wholes]
        return self._fitting(question, rows)

    def _all(self, symbol: str, values: Sequence[str]) -> list[Facts]:
        return self._episodes({symbol: values})

    def _episodes(self, cue: Cue, absent: Cue | None = None) -> list[Facts]:
        """The events of all episodes that match a cue fully, the latest first."""
        found = []
        ask = self._input.CreateIdWME("ask")
        _put(ask, "query", cue)
        if absent:
            _put(ask, "neg-query", absent)
        before = None
        while (answer := self._answer()) is not None:
            found.append(_facts(answer))
            number = int(answer.GetParameterValue("number"))
            if before is None:
                before = ask.CreateIntWME("before", number)
            else:
                before.Update(number)
        ask.DestroyWME()
        return found

    def _answer(self) -> Any:
        """What the output link shows next, if it is a full match."""
        for _ in range(_PATIENCE):
            self._agent.RunSelf(1)
            for position in range(self._agent.GetNumberCommands()):
                command = self._agent.GetCommand(position)
                if command.GetCommandName() == "nothing":
                    return None
                return command if float(command.GetParameterValue("score")) == 1.0 else None
        raise ValueError(f"Soar's agent has no answer after {_PATIENCE} decisions")


def _put(ask: Any, name: str, cue: Cue) -> None:
    """A cue as a structure like that of an episode."""
    event = ask.CreateIdWME(name).CreateIdWME("io").CreateIdWME("input-link").CreateIdWME("event")
    for symbol, values in cue.items():
        for value in values:
            _add(event, symbol, value)


def _add(event: Any, name: str, value: str | int) -> None:
    if isinstance(value, int):
        event.CreateIntWME(name, value)
    else:
        event.CreateStringWME(name, value)


def _facts(found: Any) -> Facts:
    """The event that was found."""
    event = found.FindByAttribute("event", 0).ConvertToIdentifier()
    told = {}
    for position in range(event.GetNumberChildren()):
        symbol = event.GetChild(position)
        told[symbol.GetAttribute()] = symbol.GetValueAsString()
    return {
        **{name: told[name] for name in ("uid", "type", "agent")},
        **{name: int(told[name]) for name in ("number", "begin", "end")},
        **{name: json.loads(told[name]) for name in ("features", "parts", "media_type")},
        "payload": b64decode(told["payload"]),
        "region": None if told["region"] == "none" else told["region"],
    }


if __name__ == "__main__":
    serve(SoarSide)
