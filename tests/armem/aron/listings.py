"""The type definitions printed in the thesis, as files: listings 4.1 and 4.3 to 4.8."""

from __future__ import annotations

from typing import Final


def document(*definitions: str, includes: str = "") -> str:
    """A file of type definitions as the listings have it."""
    body = "\n".join(definitions)
    types = f"<generatetypes>{body}</generatetypes>"
    return f'<?xml version="1.0" encoding="utf-8" ?>\n<typedefinition>{includes}{types}</typedefinition>'


LISTINGS: Final = {
    "4.1": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="UserCommand" namespace="::example::dto">
      <objectchild key="cmd">
        <string/>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.3": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="Location" namespace="::example::dto">
      <objectchild key="name">
        <string/>
      </objectchild>
      <objectchild key="global_pose">
        <pose/>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.4": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="Object" namespace="::example::dto">
      <objectchild key="name">
        <string/>
      </objectchild>
      <objectchild key="position">
        <object name="Location"
          namespace="::example::dto" />
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.5": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="Proprioception" namespace="::example::dto">
      <objectchild key="global_pose">
        <pose/>
      </objectchild>
      <objectchild key="configuration">
        <dictionary>
          <float32/>
        </dictionary>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.6": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="Vision" namespace="::example::dto">
      <objectchild key="image_rgb">
        <image width="1920" height="1080" type="rgb24"/>
      </objectchild>
      <objectchild key="image_depth">
        <image width="1920" height="1080" type="depth32"/>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.7": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="KnownGrasp" namespace="::example::dto">
      <objectchild key="reference_object">
        <object name="Object" namespace="::example::dto"/>
      </objectchild>
      <objectchild key="prepose">
        <framed_pose/>
      </objectchild>
      <objectchild key="grasppose">
        <framed_pose/>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
    "4.8": """<?xml version="1.0" encoding="utf-8" ?>
<typedefinition>
  <generatetypes>
    <object name="MemoryID" namespace="::armem::dto">
      <objectchild key="memory_name">
        <string/>
      </objectchild>
      <objectchild key="core_segment_name">
        <string/>
      </objectchild>
      <objectchild key="provider_segment_name">
        <string/>
      </objectchild>
      <objectchild key="entity">
        <string/>
      </objectchild>
      <objectchild key="timestamp">
        <datetime/>
      </objectchild>
      <objectchild key="instance">
        <int/>
      </objectchild>
    </object>
  </generatetypes>
</typedefinition>
""",
}
"""Listing 4.2 is the class that is generated from 4.1."""
