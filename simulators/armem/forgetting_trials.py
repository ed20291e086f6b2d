"""Trials of forgetting: an episode through mechanisms with their thresholds, online and then offline."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from armem_bridge.forgetting import Candidate, Encoder, Frequency, OnlineForgetting, Similarity, make_plan
from armem_bridge.forgetting.candidates import by_entity
from simulators.armem.episodes import Episode
from simulators.armem.mechanism_rows import Setting


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What forgetting did to an episode; the shares are of 1, times in seconds of the processor."""

    setting: Setting
    kept: float
    found: float
    online: float
    offline: float
    snapshots: Sequence[Candidate]
    """What was kept."""


class Trials:
    """Trials on one episode; what several settings have in common online is done and timed once."""

    def __init__(self, episode: Episode) -> None:
        self.episode = episode
        self._all = [candidate for candidate, _ in episode.candidates()]
        self._entities = by_entity(self._all)
        self._online: dict[tuple[Frequency | None, Similarity | None], tuple[list[Candidate], float]] = {}

    def run(self, setting: Setting) -> Trial:
        """The setting on the episode."""
        known = (setting.frequency, setting.similarity)
        if known not in self._online:
            self._online[known] = _online(self.episode, setting)
        consolidated, online = self._online[known]
        mechanisms = [each for each in (setting.decay, setting.latent) if each is not None]
        # New ones, so that offline forgetting asks for their numbers itself.
        used = self.episode.used({candidate.id for candidate in consolidated}) if setting.decay else {}
        remaining = [replace(each, used=used.get(each.id, each.used)) for each in consolidated]
        begin = process_time()
        if mechanisms:
            gone = set(make_plan(remaining, mechanisms, now=self.episode.end).snapshots)
            remaining = [candidate for candidate in remaining if candidate.id not in gone]
        offline = process_time() - begin
        return Trial(
            setting=setting,
            kept=len(remaining) / len(self._all),
            found=self.episode.found({candidate.id for candidate in remaining}),
            online=online,
            offline=offline if mechanisms else 0.0,
            snapshots=remaining,
        )

    def error(self, trial: Trial) -> float | None:
        """By how much what a trial forgot differs from what it kept nearest in time; None where an entity is gone.

        The root of the mean square difference of their numbers; 0 where nothing was forgotten.
        """
        remaining = by_entity(trial.snapshots)
        squares: list[float] = []
        for entity, candidates in self._entities.items():
            left = remaining.get(entity)
            if left is None:
                return None
            moments = [candidate.id.timestamp for candidate in left]
            known = set(moments)
            for candidate in candidates:
                moment = candidate.id.timestamp
                if moment not in known:
                    after = bisect_left(moments, moment)
                    around = left[max(after - 1, 0) : after + 1]
                    near = min(around, key=lambda other: abs(other.id.timestamp - moment))
                    squares.append(_square(near, candidate))
        return math.sqrt(np.mean(squares)) if squares else 0.0

    def encoded(self, encoder: Encoder) -> float:
        """Root mean square difference between the numbers of all snapshots and what their codes are decoded to."""
        squares: list[float] = []
        for remaining in self._entities.values():
            vectors = np.stack([candidate.compared.vector for candidate in remaining])
            encoding = encoder.fit(vectors)
            squares += np.square(encoding.decode(encoding.encode(vectors)) - vectors).mean(axis=1).tolist()
        return math.sqrt(np.mean(squares))


def _online(episode: Episode, setting: Setting) -> tuple[list[Candidate], float]:
    """What Algorithm 1 consolidates, and how long it took."""
    mechanisms = [each for each in (setting.frequency, setting.similarity) if each is not None]
    forgetting = OnlineForgetting(mechanisms)
    candidates = episode.candidates()
    consolidated: list[Candidate] = []
    begin = process_time()
    for candidate, at in candidates:
        if forgetting.decide(candidate, at).keep:
            forgetting.consolidated(candidate)
            consolidated.append(candidate)
    took = process_time() - begin
    return consolidated, took if mechanisms else 0.0


def _square(one: Candidate, other: Candidate) -> float:
    """The mean square difference of the numbers of two snapshots."""
    return float(np.square(one.compared.vector - other.compared.vector).mean())
