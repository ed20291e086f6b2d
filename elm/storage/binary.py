"""PostgreSQL's binary formats of instants, ranges and arrays, for those who write rows and those who read them."""

from __future__ import annotations

import struct
from datetime import UTC, datetime, timedelta

EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
"""The instant from which PostgreSQL counts."""
MICROSECOND = timedelta(microseconds=1)
"""What it counts in."""

INT2, INT4, INT8 = struct.Struct("!h"), struct.Struct("!i"), struct.Struct("!q")
"""Integers of 16, 32 and 64 bits; a timestamptz is an INT8."""

BOUNDED_RANGE = struct.Struct("!Biqiq")
"""A tstzrange with both bounds: flags, then size and microseconds of each."""
BOUNDED_RANGE_FIELDS = (("flags", "u1"), ("size", ">i4"), ("begin", ">i8"), ("size2", ">i4"), ("end", ">i8"))
"""The same in the words of numpy, with which a column of them is read at once."""
OPEN_RANGE = struct.Struct("!Biq")
"""A tstzrange without upper bound: flags, then size and microseconds of the lower one."""
BOTH_INCLUSIVE, LOWER_INCLUSIVE_UPPER_INFINITE = 0x06, 0x12
"""The flags of the ranges that elm writes."""
UPPER_INFINITE = 0x10
"""The flag that says there is no upper bound."""

ARRAY_HEADER = struct.Struct("!iiiii")
"""What an array begins with: dimensions, whether one is NULL, the type, the number of elements, the first index."""
EMPTY_ARRAY = struct.Struct("!iii")
"""All there is of an array without elements: dimensions, whether one is NULL, the type."""
UUID_TYPE, TEXT_TYPE = 2950, 25
"""The numbers of types, as arrays name them."""
UUID_ELEMENT = struct.Struct("!i16s")
"""An element of a uuid[]: its size, then its bytes."""
