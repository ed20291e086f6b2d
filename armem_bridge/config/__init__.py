"""Configuration: what a process with memory servers is to be, read from a TOML file (docs/armem.md)."""

from __future__ import annotations

from armem_bridge.config.building import read_config
from armem_bridge.config.refusals import InvalidConfiguration
from armem_bridge.config.values import (
    Configuration,
    IceConfig,
    LongTermConfig,
    MemoryConfig,
    Mode,
    RobotStateConfig,
)

__all__ = [
    "Configuration",
    "IceConfig",
    "InvalidConfiguration",
    "LongTermConfig",
    "MemoryConfig",
    "Mode",
    "RobotStateConfig",
    "read_config",
]
