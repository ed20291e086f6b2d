"""The interface of a consumer of data that are sent without a memory, from a slice file of our own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Final

from armem_bridge.ice import load_slices
from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.vocabulary import Vocabulary
from simulators.armem.echo import FOURTH

CHANNEL: Final = Path(__file__).with_name("channel.ice")


def load_channel() -> tuple[Vocabulary, Any]:
    """The interface of a memory, and the module of the consumer's."""
    words = load_slices([FOURTH])
    options = [f"-I{slice_directory()}", f"-I{FOURTH}", "--underscore", "--all"]
    load_ice().loadSlice("", [*options, str(CHANNEL)])
    return words, sys.modules["elmchannel"]
