"""Table A.1's clocks, durations, frequencies and points in time as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t

CLOCK_TYPE: Final = t.IntEnum(name="ClockType", values={"Realtime": 0, "Monotonic": 1, "Virtual": 2, "Unknown": 3})

DURATION: Final = t.Object(name="Duration", members={"microSeconds": t.Long()})

FREQUENCY: Final = t.Object(name="Frequency", members={"cycleDuration": DURATION})

DATE_TIME: Final = t.Object(
    name="DateTime", members={"timeSinceEpoch": DURATION, "clockType": CLOCK_TYPE, "hostname": t.String()}
)
"""As ArmarX's clients put a time into ARON data; a plain `time` in a type definition is a Long of microseconds."""

TIMING: Final[dict[str, t.TypeObject]] = {
    "ClockType": CLOCK_TYPE,
    "Duration": DURATION,
    "Frequency": FREQUENCY,
    "DateTime": DATE_TIME,
}
