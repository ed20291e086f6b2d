"""Finds Ice for this Python: where pip put it, or else where Debian and Ubuntu put theirs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec, PathFinder
from pathlib import Path
from threading import Lock
from types import ModuleType
from typing import Any, Final

from armem_bridge.ice.refusals import IceMissing

DEBIAN: Final = Path("/usr/lib/python3/dist-packages")
"""Where the package python3-zeroc-ice has its modules, for the system's own Python."""

SLICES: Final = Path("/usr/share/ice/slice")
"""Where the package zeroc-ice-slice has Ice's own slice files."""

PACKAGES: Final = frozenset({"Ice", "IcePy", "IceBox", "IceGrid", "IceMX", "IcePatch2", "IceStorm", "Glacier2"})
"""All packages that Ice consists of."""

REMEDY: Final = (
    "install it: `apt-get install python3-zeroc-ice zeroc-ice-slice` on Debian and Ubuntu (for the system's Python, "
    "and virtual environments of the same version), `pip install zeroc-ice` elsewhere. It is licensed under the GPL"
)

_lock = Lock()


class DebianFinder:
    """Finds Ice's packages among the system's, and none of the others there.

    The directory as a whole on the path would put the system's numpy or yaml in the place of those that
    this environment was made with.
    """

    def __init__(self, directory: Path) -> None:
        self._path = [str(directory)]

    def find_spec(
        self,
        name: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """The module, when it is one of Ice's."""
        return PathFinder.find_spec(name, self._path) if path is None and name in PACKAGES else None


@cache
def load_ice() -> Any:
    """The module Ice, with IceGrid and IceStorm loaded beside it. Raises `IceMissing` where there is none."""
    with _lock:
        if PathFinder.find_spec("Ice") is None and fits(DEBIAN):
            sys.meta_path.append(DebianFinder(DEBIAN))
        try:
            ice = import_module("Ice")
            import_module("IceGrid")
            import_module("IceStorm")
        except ImportError as error:
            version = ".".join(map(str, sys.version_info[:2]))
            raise IceMissing(f"Ice for Python {version} cannot be imported ({error}): {REMEDY}") from error
    return ice


def load_package(name: str) -> Any:
    """One of Ice's packages, "IceGrid" or "IceStorm"."""
    load_ice()
    return sys.modules[name]


def fits(directory: Path) -> bool:
    """Whether a directory has Ice for this very Python."""
    return any((directory / f"IcePy{suffix}").is_file() for suffix in EXTENSION_SUFFIXES)


def slice_directory() -> Path:
    """Where Ice's own slice files are, which those of ArmarX include. Raises `IceMissing`."""
    known = load_ice().getSliceDir()
    for directory in (Path(known) if known else None, SLICES):
        if directory is not None and (directory / "Ice").is_dir():
            return directory
    raise IceMissing(f"the slice files of Ice itself are missing (no {SLICES}): `apt-get install zeroc-ice-slice`")
