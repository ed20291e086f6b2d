"""How events are named on the command line: by uid, or by the integer id of their memory."""

from __future__ import annotations

from uuid import UUID

import typer

_ID_DIGITS = 19
"""Digits of the greatest id; a uid written without dashes has 32."""


def event_name(text: str) -> UUID | int:
    """The uid or id that a text names; anything else is wrong usage."""
    if text.isascii() and text.isdigit() and len(text) <= _ID_DIGITS and int(text) < 2**63:
        return int(text)
    try:
        return UUID(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is neither an id, like 17, nor a uid", param_hint="ID|UID") from None
