"""Recognition: feeding the log to recognizers and committing what they find, always the same for the same log."""

from __future__ import annotations

from elm.recognition.clocks import Timing
from elm.recognition.manager import RecognitionManager
from elm.recognition.replay import Replay, replay

__all__ = ["RecognitionManager", "Replay", "Timing", "replay"]
