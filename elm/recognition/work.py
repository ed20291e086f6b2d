"""Work: one strand at work, with a bench for each agent and one across agents, and what it counted."""

from __future__ import annotations

from elm.recognition.bench import Bench, Tally
from elm.recognition.strands import Strand
from elm.recognizers.base import Judge


class Work:
    """One strand at work: a bench for each agent, one across agents, and what it counted."""

    def __init__(self, strand: Strand, judge: Judge) -> None:
        self.strand = strand
        self.judge = judge
        self.tally = Tally(strand)
        self.benches: dict[str | None, Bench] = {}
        self.across = Bench(strand, across=True, agent=None, judge=judge, tally=self.tally)
        self.has_across = any(each.across_agents for each in strand.recognizers)
        self._single = Bench(strand, across=False, agent=None, judge=judge, tally=self.tally)

    def bench(self, agent: str | None) -> Bench:
        """The bench of one agent."""
        known = self.benches.get(agent)
        if known is None:
            known = Bench(self.strand, across=False, agent=agent, judge=self.judge, tally=self.tally)
            self.benches[agent] = known
        return known

    def wants(self, type_name: str) -> bool:
        """Whether a recognizer of single agents may want events of a type."""
        return self._single.interested(type_name)

    def wants_across(self, type_name: str) -> bool:
        """Whether a recognizer across agents may."""
        return self.across.interested(type_name)

    def counts(self) -> dict[str, dict[str, int]]:
        """What the processes count, summed over agents, by recognizer."""
        found: dict[str, dict[str, int]] = {each.name: {} for each in self.strand.recognizers}
        for bench in (*self.benches.values(), self.across):
            for name, counted in bench.counts().items():
                for what, number in counted.items():
                    found[name][what] = found[name].get(what, 0) + number
        return found
