"""Numbers of data objects as vectors: all of them, in one order, and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.vectors import Layout, devectorize, stack, vectorize
from armem_bridge.errors import LayoutMismatch
from tests.armem.aron.strategies import DATA

POSE = NDArray((2, 2, 4), "float", np.array([1, 2, 3, 4], "<f4").tobytes())
CUP = Dict({"name": String("cup"), "z": Int(3), "pose": POSE, "parts": List([Double(0.5), None, Bool(True), Long(7)])})


def test_all_numbers_in_the_order_of_their_paths() -> None:
    found = vectorize(CUP)
    assert found.vector.tolist() == [0.5, 7, 1, 2, 3, 4, 3]
    assert found.vector.dtype == np.float64
    assert [place.path for place in found.layout.places] == [("parts", 0), ("parts", 3), ("pose",), ("z",)]
    assert found.layout.size == 7
    assert found.left_out == (("name",), ("parts", 1), ("parts", 2))


def test_the_order_of_names_does_not_matter() -> None:
    other = Dict(dict(reversed(CUP.elements.items())))
    assert vectorize(other).layout == vectorize(CUP).layout
    assert vectorize(other).vector.tolist() == vectorize(CUP).vector.tolist()


@pytest.mark.parametrize(
    "data",
    [
        None,
        String("1"),
        Bool(True),
        List([]),
        NDArray((2, 1), "mystery", b"ab"),
        NDArray((2, 3), "16", b"abcdef"),
        NDArray((2, 1), "bool", b"\0\1"),
        NDArray((1, 8), "complex64", bytes(8)),
        NDArray((2, 2), "float32", bytes(4)),
        NDArray((), "float32", b""),
    ],
)
def test_what_is_not_numeric_is_left_out_and_named(data: Data | None) -> None:
    found = vectorize(Dict({"x": data}))
    assert found.vector.shape == (0,)
    assert found.layout == Layout(())
    assert found.left_out == (() if isinstance(data, List) else (("x",),))


def _exact(data: Data | None) -> bool:
    """Whether float64 holds all numbers: not those of 64 bits beyond 2^53, nor NaN in arrays bit by bit."""
    match data:
        case Long():
            return abs(data.value) <= 2**53
        case NDArray():
            return data.type not in ("int64", "uint64", "float16", "float32", "float64", "float", "double")
        case List():
            return all(map(_exact, data.elements))
        case Dict():
            return all(map(_exact, data.elements.values()))
        case _:
            return True


@given(DATA | st.none())
def test_vectors_go_there_and_back(data: Data | None) -> None:
    found = vectorize(data)
    assert found.vector.shape == (found.layout.size,)
    back = devectorize(found.vector, found.layout, data)
    assert vectorize(back).layout == found.layout
    if _exact(data):
        assert back == data


@given(st.lists(st.floats(width=32), min_size=6, max_size=6), st.lists(st.floats(), min_size=6, max_size=6))
def test_arrays_of_floats_go_there_and_back(single: list[float], double: list[float]) -> None:
    data = Dict(
        {
            "single": NDArray((2, 3, 4), "float", np.array(single, "<f4").tobytes()),
            "double": NDArray((6, 8), "float64", np.array(double, "<f8").tobytes()),
        }
    )
    found = vectorize(data)
    np.testing.assert_array_equal(found.vector, np.array([*double, *single]))
    back = devectorize(found.vector, found.layout, data)
    np.testing.assert_array_equal(vectorize(back).vector, found.vector)


def test_other_numbers_are_rounded_and_cut_to_what_the_kind_holds() -> None:
    template = Dict(
        {
            "a": Int(0),
            "b": Long(0),
            "c": Float(0),
            "d": NDArray((3, 1), "uint8", b"\0\0\0"),
            "e": NDArray((2, 8), "int64", bytes(16)),
        }
    )
    layout = vectorize(template).layout
    large = devectorize(np.array([1e12, 1e30, 1e300, 300, -5, 1.6, 1e30, -1e30]), layout, template)
    assert large == Dict(
        {
            "a": Int(2**31 - 1),
            "b": Long(2**63 - 1),
            "c": Float(3.4028234663852886e38),
            "d": NDArray((3, 1), "uint8", bytes([255, 0, 2])),
            "e": NDArray((2, 8), "int64", np.array([2**63 - 1, -(2**63)]).tobytes()),
        }
    )
    odd = devectorize(np.array([np.nan, -np.inf, np.inf, np.nan, np.inf, -np.inf, np.nan, 2.5]), layout, template)
    assert odd == Dict(
        {
            "a": Int(0),
            "b": Long(-(2**63)),
            "c": Float(np.inf),
            "d": NDArray((3, 1), "uint8", bytes([0, 255, 0])),
            "e": NDArray((2, 8), "int64", np.array([0, 2]).tobytes()),
        }
    )


def test_signalling_nan_is_nan() -> None:
    data = NDArray((1, 4), "float", b"\x01\x00\x80\x7f")
    found = vectorize(data)
    assert np.isnan(found.vector).all()
    assert np.isnan(vectorize(devectorize(found.vector, found.layout, data)).vector).all()


def test_vectors_of_one_layout_are_stacked() -> None:
    other = Dict({**CUP.elements, "z": Int(-1), "name": String("mug")})
    matrix, layout = stack([CUP, other])
    assert matrix.shape == (2, 7)
    assert layout == vectorize(CUP).layout
    assert (matrix[0] - matrix[1]).tolist() == [0, 0, 0, 0, 0, 0, 4]
    assert stack([])[0].shape == (0, 0)


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (Dict({**CUP.elements, "z": Long(3)}), r"data object 2 has z \(Long\) where z \(Int\) is expected"),
        (Dict({**CUP.elements, "z": None}), r"data object 2 lacks z \(Int\)"),
        (Dict({**CUP.elements, "zz": Int(3)}), r"data object 2 also has zz \(Int\)"),
        (Dict({**CUP.elements, "pose": NDArray((4, 4), "float", POSE.data)}), r"pose \(NDArray of \[4\] float\)"),
        (Dict({**CUP.elements, "pose": NDArray((2, 2, 4), "int32", POSE.data)}), r"pose \(NDArray of \[2, 2\] int32\)"),
        (None, "data object 2 lacks parts"),
    ],
)
def test_vectors_of_other_layouts_are_refused(other: Data | None, says: str) -> None:
    with pytest.raises(LayoutMismatch, match=says):
        stack([CUP, CUP, other])


def test_templates_and_vectors_have_the_layout() -> None:
    found = vectorize(CUP)
    with pytest.raises(LayoutMismatch, match="7 numbers"):
        devectorize(found.vector[:-1], found.layout, CUP)
    with pytest.raises(LayoutMismatch, match="the template"):
        devectorize(found.vector, found.layout, Dict({"z": Int(1)}))
