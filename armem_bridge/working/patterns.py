"""Regular expressions over names, such as no expression and no name can make slow.

They are matched by RE2, whose time grows linearly with the name and whose memory is bounded, whatever the
expression: matching cannot go wrong catastrophically. The price is that back-references and look-around
are refused; all else that C++'s std::regex (ECMAScript) offers is there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Final

import re2  # type: ignore[import-untyped]

from armem_bridge.working.refusals import InvalidQuery

PATTERN_LIMIT: Final = 1_000
"""The greatest length of an expression in characters."""

PROGRAM_BYTES: Final = 1 << 20
"""How much memory one expression may take; what compiles to more (nested counted repetitions) is refused."""

_OPTIONS = re2.Options()
_OPTIONS.max_mem = PROGRAM_BYTES
_OPTIONS.never_capture = True
_OPTIONS.log_errors = False


@lru_cache(maxsize=256)
def name_matcher(pattern: str) -> Callable[[str], bool]:
    """Whether a *whole* name matches, as std::regex_match does it: `cup` matches cup, not blue-cup.

    Raises `InvalidQuery` for what is no expression, is too long or too large, or needs what RE2 does not do.
    """
    if not isinstance(pattern, str):
        raise InvalidQuery(f"a regular expression is text, not a {type(pattern).__name__}")
    if len(pattern) > PATTERN_LIMIT:
        raise InvalidQuery(f"a regular expression of {len(pattern):,} characters is too long: at most {PATTERN_LIMIT}")
    try:
        compiled = re2.compile(pattern, _OPTIONS)
    except re2.error as error:
        why = error.args[0].decode(errors="replace") if error.args else "it cannot be compiled"
        raise InvalidQuery(
            f"the regular expression {pattern!r:.200} is refused: {why}. Write it as RE2 does: "
            f"no back-references, no look-around, no large counted repetitions"
        ) from error
    except UnicodeEncodeError as error:
        raise InvalidQuery(f"the regular expression {pattern!r:.200} contains half of a surrogate pair") from error
    match = compiled.fullmatch
    return lambda name: match(name) is not None
