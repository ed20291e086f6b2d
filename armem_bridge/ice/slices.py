"""Loads the slice files of a robot's own ArmarX workspace: the bridge has none of its own."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from threading import Lock
from typing import Final

from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.refusals import SlicesMissing, SlicesUnreadable
from armem_bridge.ice.vocabulary import Vocabulary

FILES: Final = (
    "ArmarXCore/interface/core/time.ice",
    "RobotAPI/interface/aron.ice",
    "RobotAPI/interface/armem/memory.ice",
    "RobotAPI/interface/armem/query.ice",
    "RobotAPI/interface/armem/server/MemoryInterface.ice",
    "RobotAPI/interface/armem/mns/MemoryNameSystemInterface.ice",
    "RobotAPI/interface/armem/client/MemoryListenerInterface.ice",
)
"""The files that the bridge loads, with all that they include."""

_loaded: dict[tuple[Path, ...], Vocabulary] = {}
_lock = Lock()


def load_slices(directories: Iterable[Path | str]) -> Vocabulary:
    """The interface as the slice files in these directories have it.

    A directory is one that has `RobotAPI/interface` or `ArmarXCore/interface` in it, or a workspace whose
    packages keep them in `RobotAPI/source` and `ArmarXCore/source`. Ice encodes by position: only the files
    that the robot's own components were built from are any use.

    A process loads one set of files, for their names are global in it; the same ones again cost nothing.
    Raises `SlicesMissing`, `SlicesUnreadable`, `UnknownGeneration`, or `IceMissing`.
    """
    wanted = tuple(Path(directory).expanduser().resolve() for directory in directories)
    with _lock:
        if wanted in _loaded:
            return _loaded[wanted]
        if _loaded:
            (others,) = _loaded
            raise SlicesUnreadable(
                f"this process has loaded the slice files of {_shown(others)} already, and can load no others: "
                f"take another process for {_shown(wanted)}"
            )
        roots = _roots(wanted)
        files = [_find(name, roots, wanted) for name in FILES]
        _load(files, roots)
        vocabulary = Vocabulary(sys.modules["armarx"], _shown(wanted))
        _loaded[wanted] = vocabulary
    return vocabulary


def _roots(directories: Iterable[Path]) -> list[Path]:
    """Every directory that file names can begin at."""
    candidates = (
        root
        for directory in directories
        for root in (directory, directory / "ArmarXCore" / "source", directory / "RobotAPI" / "source")
    )
    return [root for root in candidates if root.is_dir()]


def _find(name: str, roots: Iterable[Path], directories: tuple[Path, ...]) -> Path:
    for root in roots:
        if (root / name).is_file():
            return root / name
    raise SlicesMissing(
        f"no {name} in {_shown(directories)}: name the directories of the ArmarX workspace that the robot's "
        f"components were built from"
    )


def _load(files: Iterable[Path], roots: Iterable[Path]) -> None:
    ice = load_ice()
    options = [f"-I{slice_directory()}", *(f"-I{root}" for root in roots), "--underscore", "--all"]
    for path in files:
        try:
            ice.loadSlice("", [*options, str(path)])
        except RuntimeError as error:
            raise SlicesUnreadable(f"Ice cannot load {path}: {error}; what it found wrong is on stderr") from error


def _shown(directories: tuple[Path, ...]) -> str:
    return ", ".join(map(str, directories)) or "no directory at all"
