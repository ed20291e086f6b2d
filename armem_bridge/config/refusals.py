"""What reading a configuration refuses, and the words for it: file, key and remedy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

from armem_bridge.errors import ArmemError


class InvalidConfiguration(ArmemError, ValueError):
    """A configuration file cannot be read, or asks for what cannot be. The message names file, key and remedy."""


@dataclass(frozen=True, slots=True)
class Place:
    """A key in a configuration file, such as `memories "Object".core_segments "Instance".type`."""

    file: Path
    key: str = ""

    def __truediv__(self, key: str) -> Place:
        """The key below this one."""
        return replace(self, key=f"{self.key}.{key}" if self.key else key)

    def refuse(self, why: str) -> NoReturn:
        """Raise `InvalidConfiguration`."""
        raise InvalidConfiguration(f"{self.file}: {self.key}: {why}" if self.key else f"{self.file}: {why}")

    @contextmanager
    def said(self) -> Iterator[None]:
        """What the bridge refuses in here is said to be wrong at this place."""
        try:
            yield
        except InvalidConfiguration:
            raise
        except ArmemError as error:
            raise InvalidConfiguration(f"{self.file}: {self.key}: {error}") from error

    def path(self, text: str) -> Path:
        """The file that a text in the configuration names: from the directory of the configuration on."""
        if not text or "\0" in text:
            self.refuse(f"a file or directory has a name, and not {text!r:.80}")
        return self.file.parent / Path(text).expanduser()


def named(kind: str, name: str, number: int) -> str:
    """A table of several as messages call it: by its name, or else by its number from 1 on."""
    return f'{kind} "{name}"' if name else f"{kind} number {number + 1}"
