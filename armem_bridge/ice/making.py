"""Makes objects of classes that the loaded slice files define, with all members that the bridge does not know."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from armem_bridge.ice.refusals import SlicesUnreadable


def blank(cls: Any, *needed: str, **fixed: Any) -> Callable[[], Any]:
    """A function that makes objects of `cls`, on which those members are to be set that differ from a new one's.

    Members that nobody sets are looked up in a subclass, where they are as a new object has them, or as
    `fixed` says; nobody changes their values, for all objects share them. This takes less than half the time of
    the constructors that Ice generates. Raises `SlicesUnreadable` where the class has no member of one of
    the names `needed` or `fixed`.
    """
    defaults = vars(cls())
    for name in (*needed, *fixed):
        if name not in defaults:
            raise SlicesUnreadable(
                f"the slice files' {cls.__module__}.{cls.__name__} has no member {name}, only {', '.join(defaults)}: "
                f"they are of another generation than they look like"
            )
    shape: Any = type(cls.__name__, (cls,), defaults | fixed)
    new = shape.__new__
    return lambda: new(shape)


def maker(cls: Any, *needed: str, **fixed: Any) -> Callable[..., Any]:
    """A function that makes objects of `cls` from members by their names, for where time does not matter."""
    new = blank(cls, *needed, **fixed)

    def make(**members: Any) -> Any:
        made = new()
        for name, value in members.items():
            setattr(made, name, value)
        return made

    return make


def first_member(cls: Any, *names: str) -> str | None:
    """The first of several names that a class has as a member; None if it has none of them."""
    members = vars(cls())
    return next((name for name in names if name in members), None)
