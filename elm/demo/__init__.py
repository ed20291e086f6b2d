"""The demo: half an hour in the life of a real robot mower, remembered, asked about and drawn."""

from __future__ import annotations

from elm.demo.tour import run

__all__ = ["run"]
