"""The rows of table 5.1 and some beside them: which mechanisms forget together, and what the thesis found for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType
from typing import Literal

from armem_bridge.forgetting import (
    PCA,
    Ebbinghaus,
    Encoder,
    Exponential,
    Frequency,
    LatentSimilarity,
    RandomProjection,
    Similarity,
    TimeDecay,
)
from armem_bridge.forgetting.activation import Activation

TAU = 60.0
"""Time constant of the activations in seconds, of both kinds: whole minutes, as Ebbinghaus counted."""
COUNT = 2
"""n of the online similarity, as in the thesis."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """A combination of mechanisms; `published` is the best size in per cent that the thesis has for it, if any."""

    number: int
    frequency: bool = False
    similarity: str = ""
    decay: Literal["", "exponential", "ebbinghaus"] = ""
    latent: Literal["", "pca", "random projection"] = ""
    published: float | None = None


ROWS = (
    Row(number=1, frequency=True, published=15.28),
    Row(number=2, similarity="mse", published=12.31),
    Row(number=3, similarity="cosine", published=14.10),
    Row(number=4, decay="exponential", published=46.60),
    Row(number=5, latent="pca", published=4.62),
    Row(number=6, frequency=True, similarity="mse", published=7.75),
    Row(number=7, frequency=True, decay="exponential", published=7.12),
    Row(number=8, frequency=True, latent="pca", published=6.31),
    Row(number=9, frequency=True, similarity="mse", decay="exponential", published=3.76),
    Row(number=10, frequency=True, similarity="mse", latent="pca", published=3.14),
    Row(number=11, frequency=True, decay="exponential", latent="pca", published=4.50),
    Row(number=12, similarity="mse", decay="exponential", published=5.72),
    Row(number=13, similarity="mse", latent="pca", published=3.25),
    Row(number=14, similarity="mse", decay="exponential", latent="pca", published=3.07),
    Row(number=15, decay="exponential", latent="pca", published=6.95),
    Row(number=16, frequency=True, similarity="mse", decay="exponential", latent="pca", published=3.03),
    Row(number=17, similarity="mae"),
    Row(number=18, decay="ebbinghaus"),
    Row(number=19, latent="random projection"),
)
"""The sixteen rows of table 5.1, and three for what it does not compare."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The thresholds that are tried, and how long codes are."""

    waits: tuple[float, ...]
    """Seconds."""
    distances: Mapping[str, tuple[float, ...]]
    idle: tuple[float, ...]
    """Seconds since the last use: the activation after each is a threshold of the decay."""
    latent: tuple[float, ...]
    size: int

    def coarser(self) -> Grid:
        """Every other threshold."""
        return Grid(
            waits=self.waits[::2],
            distances=MappingProxyType({name: values[::2] for name, values in self.distances.items()}),
            idle=self.idle[::2],
            latent=self.latent[::2],
            size=self.size,
        )


@dataclass(frozen=True, kw_only=True)
class Setting:
    """The mechanisms of a row with their thresholds."""

    frequency: Frequency | None = None
    similarity: Similarity | None = None
    decay: TimeDecay | None = None
    latent: LatentSimilarity | None = None

    def thresholds(self) -> dict[str, float]:
        """The thresholds by the names that the thesis has for them; waits in seconds."""
        named = {
            "delta_wait": self.frequency.wait if self.frequency else None,
            "d_min": self.similarity.minimum if self.similarity else None,
            "a_min": self.decay.minimum if self.decay else None,
            "d_min_latent": self.latent.minimum if self.latent else None,
        }
        return {name: value for name, value in named.items() if value is not None}


def settings(row: Row, grid: Grid) -> Iterator[Setting]:
    """The mechanisms of a row with all thresholds of a grid; where three or more are combined, with every other one."""
    if sum(map(bool, (row.frequency, row.similarity, row.decay, row.latent))) > 2:
        grid = grid.coarser()
    activation: Activation = Ebbinghaus(minute=TAU) if row.decay == "ebbinghaus" else Exponential(TAU)
    encoder: Encoder = PCA(grid.size) if row.latent == "pca" else RandomProjection(grid.size)
    for wait, distance, idle, latent in product(
        grid.waits if row.frequency else (None,),
        grid.distances[row.similarity] if row.similarity else (None,),
        grid.idle if row.decay else (None,),
        grid.latent if row.latent else (None,),
    ):
        yield Setting(
            frequency=None if wait is None else Frequency(wait=wait),
            similarity=None if distance is None else Similarity(distance=row.similarity, minimum=distance, count=COUNT),
            decay=None if idle is None else TimeDecay(activation=activation, minimum=activation(idle)),
            latent=None if latent is None else LatentSimilarity(distance="cosine", minimum=latent, encoder=encoder),
        )
