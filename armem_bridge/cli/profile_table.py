"""`elm armem profiles`: the memory servers of ArmarX that a configuration can name."""

from __future__ import annotations

from elm.cli.rows import RowOutput, row_format, write_rows


def profiles(output: RowOutput = None) -> None:
    """List the profiles of memory servers: their memories and core segments, with the types of these."""
    from armem_bridge.profiles import PROFILES

    rows = [
        (profile.name, profile.memory, segment.name, segment.type_name or None, ", ".join(segment.poses) or None)
        for profile in PROFILES.values()
        for segment in profile.core_segments
    ]
    write_rows(("profile", "memory", "core_segment", "type", "poses"), rows, row_format(output))
