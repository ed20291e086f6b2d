"""Forgetting: what is not worth keeping, on the way into long-term memory and in it (sections 4.5.1 and 4.5.3)."""

from __future__ import annotations

from armem_bridge.forgetting.activation import Activation, Ebbinghaus, Exponential
from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.encoders import PCA, Encoder, Encoding, RandomProjection
from armem_bridge.forgetting.forgetter import Applied, Forgetter, Forgetting
from armem_bridge.forgetting.mechanisms import Frequency, LatentSimilarity, Retention, Similarity, TimeDecay
from armem_bridge.forgetting.offline import make_plan
from armem_bridge.forgetting.online import Decision, OnlineForgetting, Verdict
from armem_bridge.forgetting.plan import Going, Plan
from armem_bridge.forgetting.refusals import InvalidEncoder, InvalidMechanism

__all__ = [
    "PCA",
    "Activation",
    "Applied",
    "Candidate",
    "Decision",
    "Ebbinghaus",
    "Encoder",
    "Encoding",
    "Exponential",
    "Forgetter",
    "Forgetting",
    "Frequency",
    "Going",
    "InvalidEncoder",
    "InvalidMechanism",
    "LatentSimilarity",
    "OnlineForgetting",
    "Plan",
    "RandomProjection",
    "Retention",
    "Similarity",
    "TimeDecay",
    "Verdict",
    "make_plan",
]
