"""Recognizers of complex events: the protocol, patterns made of steps, and ready-made ones."""

from __future__ import annotations

from elm.recognizers.base import Emission, Fed, Judge, Process, Recognizer
from elm.recognizers.conditions import allen, compare, near, same, same_region, told
from elm.recognizers.elements import absent, step, without
from elm.recognizers.episodes import Mission, Repetition, Session
from elm.recognizers.measures import count, first, greatest, last, least, mean, rate, sum_of
from elm.recognizers.patterns import AfterMatch, Pattern
from elm.recognizers.places import Standstill, Stay
from elm.recognizers.together import CoOccurrence
from elm.recognizers.windows import Windowed

__all__ = [
    "AfterMatch",
    "CoOccurrence",
    "Emission",
    "Fed",
    "Judge",
    "Mission",
    "Pattern",
    "Process",
    "Recognizer",
    "Repetition",
    "Session",
    "Standstill",
    "Stay",
    "Windowed",
    "absent",
    "allen",
    "compare",
    "count",
    "first",
    "greatest",
    "last",
    "least",
    "mean",
    "near",
    "rate",
    "same",
    "same_region",
    "step",
    "sum_of",
    "told",
    "without",
]
