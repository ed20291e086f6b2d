"""Files that are written whole or not at all, so that a run that is stopped leaves the figures of the last one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def write_json(file: Path, value: Any, *, indent: int | None = None) -> None:
    """Write a value as JSON in the place of what was there; missing directories are made."""
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_name(f"{file.name}.unfinished")
    unfinished.write_text(json.dumps(value, indent=indent, ensure_ascii=False) + "\n", encoding="utf-8")
    unfinished.replace(file)
