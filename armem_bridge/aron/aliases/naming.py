"""Table A.1's names of resources in packages, and the ids under which ArmarX knows objects and memories."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.timing import DATE_TIME

PACKAGE_PATH: Final = t.Object(name="PackagePath", members={"package": t.String(), "path": t.String()})

OBJECT_ID: Final = t.Object(
    name="ObjectID", members={"dataset": t.String(), "className": t.String(), "instanceName": t.String()}
)
"""Which object: of which data set and class, and which of that class; not in the table, but what its types refer to."""

MEMORY_ID: Final = t.Object(
    name="MemoryID",
    members={
        "memoryName": t.String(),
        "coreSegmentName": t.String(),
        "providerSegmentName": t.String(),
        "entityName": t.String(),
        "timestamp": DATE_TIME,
        "instanceIndex": t.Int(),
    },
)
"""A link to another part of memory (section 4.4): as ArmarX's clients write it, not with listing 4.8's names."""

NAMING: Final[dict[str, t.TypeObject]] = {
    "PackagePath": PACKAGE_PATH,
    "ObjectID": OBJECT_ID,
    "MemoryID": MEMORY_ID,
}
