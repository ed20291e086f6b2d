"""What units of dialogue are recognized by: utterances with their annotations, and these by the unit they belong to."""

from __future__ import annotations

from datetime import timedelta

from elm import cues
from elm.recognizers import CoOccurrence, Recognizer, Session, count, first

PAUSE = timedelta(hours=1)
"""Longer than anybody was silent within a unit."""

ANNOTATED = CoOccurrence(
    name="scout-annotated",
    version=1,
    type="AnnotatedUtterance",
    first=cues.is_a("Utterance"),
    second=cues.exactly("Annotation") & cues.feature_names("superset", ["unit"]),
    same=["utterance"],
    within=timedelta(0),
    measures={"unit": first("unit", "second"), "relation": first("relation", "second")},
)
"""An utterance with its annotation, which is about the same time, whenever it was made."""

UNITS = Session(
    name="scout-units",
    version=1,
    type="TransactionUnit",
    parents=["Episode"],
    cue=cues.exactly("AnnotatedUtterance"),
    gap=PAUSE,
    partition=["unit"],
    measures={"unit": first("unit"), "utterances": count()},
)
"""All that was said until an instruction was carried out, or given up."""

RECOGNIZERS: tuple[Recognizer, ...] = (ANNOTATED, UNITS)
