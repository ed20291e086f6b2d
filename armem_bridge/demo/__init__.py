"""The demo: a minute in a kitchen, in the object memory of figure 4.7 and in elm behind it."""

from __future__ import annotations

from armem_bridge.demo.tour import run

__all__ = ["run"]
