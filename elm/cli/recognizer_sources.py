"""Where recognizers come from: modules named on the command line, and installed packages that offer some."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from elm.errors import ElmError, InvalidValue
from elm.recognizers.base import Recognizer, check_identity, fingerprint

OFFERED = "elm.recognizers"
"""The entry-point group in which a package offers recognizers: ANYTHING = "module" or "module:name"."""
_Done = TypeVar("_Done")
_METHODS = ("start", "resume")
_TRAITS = ("name", "version", "across_agents", "interest", "outputs", "definition")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sourced:
    """A recognizer and where it was found."""

    recognizer: Recognizer
    origin: str


def sourced(named: Sequence[str], only: Sequence[str]) -> list[Sourced]:
    """The recognizers of modules named MODULE[:NAME] and of installed packages; of these `only` the ones so named.

    Packages are not asked when the modules have all that is wanted. What turns up twice counts once; different
    recognizers of one name are refused.
    """
    sources = _Modules()
    found = [each for text in named for each in sources.named(text)]
    missing = {*only} - {each.recognizer.name for each in found}
    if missing or not only:
        found += sources.offered()
    wanted = [each for each in found if not only or each.recognizer.name in only]
    for name in only:
        if all(each.recognizer.name != name for each in wanted):
            known = ", ".join(sorted({each.recognizer.name for each in found})) or "none"
            raise InvalidValue(f"there is no recognizer {name!r} to select with --only: found {known}")
    return _once_each(wanted)


def _once_each(found: Iterable[Sourced]) -> list[Sourced]:
    by_name: dict[str, Sourced] = {}
    for each in found:
        name = each.recognizer.name
        known = by_name.setdefault(name, each)
        if fingerprint(known.recognizer) != fingerprint(each.recognizer):
            raise InvalidValue(
                f"two recognizers are named {name!r}, one of {known.origin} and one of {each.origin}: "
                f"give each its own name"
            )
    return list(by_name.values())


class _Modules:
    """The modules that were asked for, each loaded once."""

    def __init__(self) -> None:
        self._files: dict[Path, ModuleType] = {}

    def named(self, text: str) -> list[Sourced]:
        """The recognizers of MODULE[:NAME]."""
        module, colon, name = text.partition(":")
        if not module or (colon and not all(part.isidentifier() for part in name.split("."))):
            raise InvalidValue(f"recognizers are named MODULE or MODULE:NAME, as in kitchen.py:grasping, not {text!r}")
        if not _is_file(module):
            # As `python -m` does: what lies in the current directory can be named.
            _look_in(Path.cwd())
        return self._recognizers(module, name, text)

    def offered(self) -> list[Sourced]:
        """The recognizers that installed packages offer."""
        from importlib.metadata import entry_points

        found: list[Sourced] = []
        for point in sorted(entry_points(group=OFFERED), key=lambda each: each.name):
            package = "" if point.dist is None else f" of {point.dist.name}"
            try:
                found += self._recognizers(point.module, point.attr, point.value)
            except ElmError as error:
                raise InvalidValue(f"the entry point {point.name!r}{package} offers no recognizers: {error}") from error
        return found

    def _recognizers(self, module_name: str, name: str, origin: str) -> list[Sourced]:
        module = self._module(module_name)
        if not name:
            everything = vars(module).items()
            found = [(f"{origin}:{key}", value) for key, value in everything if _is_recognizer(value)]
            if not found:
                raise InvalidValue(
                    f"{origin} has no recognizers of its own; those in a list are found when it is named, "
                    f"as in {origin}:NAME"
                )
        else:
            found = [(origin, value) for value in _members(_attribute(module, module_name, name), origin)]
        return [Sourced(recognizer=_checked(value, origin), origin=origin) for origin, value in found]

    def _module(self, name: str) -> ModuleType:
        if not _is_file(name):
            try:
                return _imported(name, lambda: importlib.import_module(name))
            except InvalidValue as error:
                lacking = error.__cause__
                if isinstance(lacking, ModuleNotFoundError) and f"{name}.".startswith(f"{lacking.name}."):
                    raise InvalidValue(
                        f"there is no module {lacking.name!r} to take recognizers from: correct the name, "
                        f"or name its file, as in kitchen.py"
                    ) from lacking
                raise
        path = Path(name).resolve()
        if path not in self._files:
            self._files[path] = _loaded(path, name)
        return self._files[path]


def _is_file(name: str) -> bool:
    return name.endswith(".py") or "/" in name


def _loaded(path: Path, name: str) -> ModuleType:
    if not path.is_file():
        raise InvalidValue(f"there is no file {name!r} to take recognizers from")
    # Under its path: the stem may be the name of another module.
    spec = importlib.util.spec_from_file_location(str(path), path)
    if spec is None or spec.loader is None:
        raise InvalidValue(f"{name!r} is no Python file: recognizers are defined in Python")
    module = importlib.util.module_from_spec(spec)
    # As `python FILE` does: it may import what lies beside it.
    _look_in(path.parent)
    sys.modules[str(path)] = module
    run = spec.loader.exec_module
    _imported(name, lambda: run(module))
    return module


def _look_in(directory: Path) -> None:
    if str(directory) not in sys.path:
        sys.path.insert(0, str(directory))


def _imported(name: str, work: Callable[[], _Done]) -> _Done:
    try:
        return work()
    except (Exception, SystemExit) as error:
        raise InvalidValue(f"{name} cannot be imported{_place(error)}: {type(error).__name__}: {error}") from error


def _place(error: BaseException) -> str:
    """Where it went wrong: the line of the module that was being imported."""
    if isinstance(error, SyntaxError):
        return f" ({error.filename}, line {error.lineno})"
    frames = (frame for frame in traceback.extract_tb(error.__traceback__) if frame.name == "<module>")
    return "".join(f" ({frame.filename}, line {frame.lineno})" for frame in islice(frames, 1))


def _attribute(module: ModuleType, module_name: str, name: str) -> Any:
    value: Any = module
    for part in name.split("."):
        try:
            value = getattr(value, part)
        except AttributeError as error:
            known = ", ".join(key for key, each in vars(module).items() if _is_recognizer(each)) or "none"
            raise InvalidValue(f"{module_name} has no {name!r}; the recognizers it has: {known}") from error
    return value


def _members(value: Any, origin: str) -> Iterator[Any]:
    if _is_recognizer(value):
        yield value
        return
    members = list(value) if isinstance(value, Iterable) and not isinstance(value, str | bytes) else []
    if not members or not all(map(_is_recognizer, members)):
        raise InvalidValue(f"{origin} is neither a recognizer nor some of them, but {value!r:.80}")
    yield from members


def _is_recognizer(value: Any) -> bool:
    if isinstance(value, type):
        return False
    return all(callable(getattr(type(value), name, None)) for name in _METHODS) and all(
        hasattr(value, name) for name in _TRAITS
    )


def _checked(recognizer: Recognizer, origin: str) -> Recognizer:
    try:
        check_identity(recognizer.name, recognizer.version)
        fingerprint(recognizer)
    except (InvalidValue, TypeError) as error:
        raise InvalidValue(f"{origin} cannot be recognized by: {error}") from error
    return recognizer
