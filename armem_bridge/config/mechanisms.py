"""The mechanisms of forgetting that a configuration asks for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import assert_never

from armem_bridge.config.refusals import Place
from armem_bridge.config.tables import (
    LatentSimilarityTable,
    OfflineTable,
    OnlineTable,
    RetentionTable,
    SimilarityTable,
    TimeDecayTable,
)
from armem_bridge.forgetting.activation import Activation, Ebbinghaus, Exponential
from armem_bridge.forgetting.encoders import PCA, Encoder, RandomProjection
from armem_bridge.forgetting.mechanisms import (
    Frequency,
    LatentSimilarity,
    Offline,
    Online,
    Retention,
    Similarity,
    TimeDecay,
)


def online_mechanisms(table: OnlineTable, at: Place) -> tuple[Online, ...]:
    """The mechanisms of `[forgetting.online]`."""
    found: list[Online] = [*_shared(table, at)]
    if table.similarity is not None:
        found.append(_similarity(table.similarity, at / "similarity"))
    return tuple(found)


def offline_mechanisms(table: OfflineTable, at: Place) -> tuple[Offline, ...]:
    """The mechanisms of `[forgetting.offline]`."""
    found: list[Offline] = [*_shared(table, at)]
    if table.similarity is not None:
        found.append(_latent_similarity(table.similarity, at / "similarity"))
    if table.retention is not None:
        found.append(_retention(table.retention, at / "retention"))
    return tuple(found)


def _shared(table: OnlineTable | OfflineTable, at: Place) -> Iterator[TimeDecay | Frequency]:
    """What forgets by itself, online and offline alike."""
    if table.time_decay is not None:
        yield _time_decay(table.time_decay, at / "time_decay")
    if table.frequency is not None:
        with (at / "frequency").said():
            yield Frequency(wait=table.frequency.wait)


def _time_decay(table: TimeDecayTable, at: Place) -> TimeDecay:
    with at.said():
        return TimeDecay(activation=_activation(table, at), minimum=table.minimum)


def _activation(table: TimeDecayTable, at: Place) -> Activation:
    exponential = {name: value for name in ("tau",) if (value := getattr(table, name)) is not None}
    ebbinghaus = {name: value for name in ("k", "c", "minute") if (value := getattr(table, name)) is not None}
    match table.activation:
        case "exponential":
            _none_of(ebbinghaus, "belongs to the activation ebbinghaus", at)
            return Exponential(**exponential)
        case "ebbinghaus":
            _none_of(exponential, "belongs to the activation exponential", at)
            return Ebbinghaus(**ebbinghaus)
        case _:
            assert_never(table.activation)


def _similarity(table: SimilarityTable, at: Place) -> Similarity:
    with at.said():
        if table.count is None:
            return Similarity(distance=table.distance, minimum=table.minimum)
        return Similarity(distance=table.distance, minimum=table.minimum, count=table.count)


def _latent_similarity(table: LatentSimilarityTable, at: Place) -> LatentSimilarity:
    with at.said():
        return LatentSimilarity(
            distance=table.distance, minimum=table.minimum, count=table.count, encoder=_encoder(table, at)
        )


def _encoder(table: LatentSimilarityTable, at: Place) -> Encoder | None:
    if table.encoder == "none":
        given = {name: value for name in ("size", "seed") if (value := getattr(table, name)) is not None}
        _none_of(given, "belongs to an encoder: say which one", at)
        return None
    if table.size is None:
        (at / "size").refuse("is missing: say how many numbers a code has")
    match table.encoder:
        case "pca":
            _none_of({} if table.seed is None else {"seed": table.seed}, "belongs to the encoder random_projection", at)
            return PCA(size=table.size)
        case "random_projection":
            return RandomProjection(size=table.size, seed=table.seed or 0)
        case _:
            assert_never(table.encoder)


def _retention(table: RetentionTable, at: Place) -> Retention:
    budgets = (table.count, table.bytes, table.age, table.total_count, table.total_bytes)
    if all(budget is None for budget in budgets):
        at.refuse("has no budget: give count, bytes, age, total_count or total_bytes")
    with at.said():
        return Retention(
            count=table.count,
            size=table.bytes,
            age=table.age,
            total_count=table.total_count,
            total_size=table.total_bytes,
        )


def _none_of(given: dict[str, float], why: str, at: Place) -> None:
    for name in given:
        (at / name).refuse(f"{why}, or leave it out")
