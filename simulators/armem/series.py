"""Figures of a series of short times, in microseconds, as the thesis tells them: means and variances."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

import numpy as np


def in_microseconds(series: Sequence[float]) -> dict[str, float]:
    """Count, mean, variance (in square microseconds), median, tail and greatest of a series of seconds."""
    micros = [each * 1e6 for each in series]
    median, tail = np.percentile(micros, [50, 95]).tolist()
    figures = {
        "mean": statistics.fmean(micros),
        "variance": statistics.pvariance(micros),
        "median": median,
        "p95": tail,
        "max": max(micros),
    }
    return {"count": len(series), **{name: round(value, 2) for name, value in figures.items()}}
