"""ARON's data objects on the wire, in both directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.versions import VersionCounts
from armem_bridge.ice.generation import Generation
from armem_bridge.ice.making import blank
from armem_bridge.ice.refusals import MalformedMessage
from armem_bridge.ice.vocabulary import Vocabulary

TEXT_VERSION: Final = "beta 0.2.3"
"""What released clients of the third generation write where the slice files leave the version empty."""

ELEMENTS_LIMIT: Final = 1_000_000
"""How many elements the lists and dicts of one data object have in all.

A message names an object once and may refer to it often: without a limit a few hundred bytes would grow
into a tree that no memory holds.
"""


class _Reading:
    """One data object on its way: how many elements it may still have, and the containers that were read."""

    __slots__ = ("known", "left")

    def __init__(self) -> None:
        self.left = ELEMENTS_LIMIT
        self.known: dict[int, tuple[List | Dict, int]] = {}

    def take(self, count: int) -> None:
        """Account for so many elements."""
        self.left -= count
        if self.left < 0:
            raise MalformedMessage(f"an ARON object on the wire has more than {ELEMENTS_LIMIT:,} elements in all")

    def again(self, wire: Any) -> List | Dict | None:
        """The same container, where it was read before; its elements count once more."""
        known = self.known.get(id(wire))
        if known is None:
            return None
        data, weight = known
        self.take(weight)
        return data

    def remember(self, wire: Any, data: List | Dict, left: int) -> None:
        """Keep a container that began when so many elements were left."""
        self.known[id(wire)] = (data, left - self.left)


_Reader = Callable[[Any, _Reading], Data]


class _Readers(dict[Any, _Reader]):
    """The reader of every class; None has one too, which callers see to."""

    def __missing__(self, cls: Any) -> _Reader:
        raise MalformedMessage(
            f"an ARON object on the wire is of the class {cls.__name__}, which the bridge cannot read"
        )


class AronWire:
    """Data objects to and from those of the loaded slice files.

    What is read is checked as all data objects are: depth, sizes, text. The version of what arrives is
    counted in `versions`, once an instance, and never refused.
    """

    def __init__(self, words: Vocabulary) -> None:
        self.versions = VersionCounts()
        self._texts: dict[Any, str] = {}
        dto = words.aron_data
        kinds: dict[type[Data], Any] = {
            kind: words.member(dto, name)
            for kind, name in (
                (String, "AronString"),
                (Bool, "AronBool"),
                (Int, "AronInt"),
                (Long, "AronLong"),
                (Float, "AronFloat"),
                (Double, "AronDouble"),
                (List, "List"),
                (Dict, "Dict"),
                (NDArray, "NDArray"),
            )
        }
        version = _version(words, kinds[String])
        self.version = _shown(version)
        """The version that the bridge writes, as text."""

        self._readers = _Readers()
        self._writers: dict[type, Callable[[Any], Any]] = {}
        for kind in (String, Bool, Int, Long, Float, Double):
            self._readers[kinds[kind]] = _scalar_reader(kind)
            self._writers[kind] = _scalar_writer(blank(kinds[kind], "value", VERSION=version))
        self._readers[kinds[List]] = self._read_list
        self._readers[kinds[Dict]] = self._read_dict
        self._readers[kinds[NDArray]] = _read_array
        self._writers[List] = self._list_writer(blank(kinds[List], "elements", VERSION=version))
        self._writers[Dict] = self._dict_writer(blank(kinds[Dict], "elements", VERSION=version))
        # ArmarX's clients leave the version of an NDArray as the slice files have it, and so does the bridge.
        self._writers[NDArray] = _array_writer(blank(kinds[NDArray], "shape", "type", "data"))
        self._writers[type(None)] = lambda data: data

    def read(self, wire: Any) -> Dict | None:
        """The data of an instance; None for null.

        Raises `MalformedMessage`, or `InvalidData` for what no data object can be.
        """
        if wire is None:
            return None
        self._count(wire.VERSION)
        try:
            data = self._readers[type(wire)](wire, _Reading())
        except RecursionError as error:
            raise MalformedMessage("an ARON object on the wire contains itself, or nests without end") from error
        if type(data) is not Dict:
            raise MalformedMessage(f"the data of an instance are an ARON Dict, not a {type(data).__name__}")
        return data

    def write(self, data: Dict | None) -> Any:
        """A data object as the slice files have it; None for null."""
        return self._writers[type(data)](data)

    def _count(self, version: Any) -> None:
        if type(version) is not str:
            # Ice makes a new value for every object: its members are what tells versions apart.
            version = () if version is None else tuple(vars(version).values())
            if version not in self._texts:
                self._texts[version] = ".".join(map(str, version))
            version = self._texts[version]
        self.versions.add(version)

    def _read_list(self, wire: Any, reading: _Reading) -> List | Dict:
        known = reading.again(wire)
        if known is not None:
            return known
        readers, elements, left = self._readers, wire.elements, reading.left
        reading.take(len(elements))
        data = List([None if each is None else readers[type(each)](each, reading) for each in elements])
        reading.remember(wire, data, left)
        return data

    def _read_dict(self, wire: Any, reading: _Reading) -> List | Dict:
        known = reading.again(wire)
        if known is not None:
            return known
        readers, elements, left = self._readers, wire.elements, reading.left
        reading.take(len(elements))
        data = Dict(
            {name: None if each is None else readers[type(each)](each, reading) for name, each in elements.items()}
        )
        reading.remember(wire, data, left)
        return data

    def _list_writer(self, new: Callable[[], Any]) -> Callable[[Any], Any]:
        writers = self._writers

        def write(data: List) -> Any:
            made = new()
            made.elements = [writers[type(each)](each) for each in data.elements]
            return made

        return write

    def _dict_writer(self, new: Callable[[], Any]) -> Callable[[Any], Any]:
        writers = self._writers

        def write(data: Dict) -> Any:
            made = new()
            made.elements = {name: writers[type(each)](each) for name, each in data.elements.items()}
            return made

        return write


def _scalar_reader(kind: Callable[[Any], Data]) -> _Reader:
    return lambda wire, _: kind(wire.value)


def _scalar_writer(new: Callable[[], Any]) -> Callable[[Any], Any]:
    def write(data: Any) -> Any:
        made = new()
        made.value = data.value
        return made

    return write


def _read_array(wire: Any, _: _Reading) -> NDArray:
    return NDArray(wire.shape, wire.type, wire.data)


def _array_writer(new: Callable[[], Any]) -> Callable[[Any], Any]:
    def write(data: NDArray) -> Any:
        made = new()
        made.shape, made.type, made.data = data.shape, data.type, data.data
        return made

    return write


def _version(words: Vocabulary, cls: Any) -> Any:
    """The version that is written: a new one of the fourth generation, the slice files' own text of the third."""
    if words.generation is Generation.FOURTH:
        return words.aron.Version()
    return cls().VERSION or TEXT_VERSION


def _shown(version: Any) -> str:
    return version if type(version) is str else ".".join(map(str, vars(version).values()))
