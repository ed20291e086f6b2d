"""The settings of a private PostgreSQL server: durable, and fit for steady ingestion on one machine."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from elm.storage.server_socket import PORT

_GIGABYTE = 1 << 30


def default_settings(socket_directory: Path) -> dict[str, str]:
    """The settings by name: no network, every commit on disk, buffers by the size of the machine."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    settings = {
        "listen_addresses": "",
        "port": str(PORT),
        "unix_socket_directories": str(socket_directory),
        "unix_socket_permissions": "0700",
        "max_connections": "100",
        "shared_buffers": f"{min(_GIGABYTE, memory // 4) // 1024}kB",
        "fsync": "on",
        "synchronous_commit": "on",
        "max_wal_size": "4GB",
        "checkpoint_timeout": "15min",
        "log_checkpoints": "off",
        # A memory grows from nothing to thousands of events in seconds; until the planner knows, it reads far more.
        "autovacuum_naptime": "10s",
        "timezone": "UTC",
        "log_timezone": "UTC",
        "jit": "off",
    }
    if sys.platform == "linux":
        # A restart after a crash otherwise syncs every file of the data directory one by one.
        settings["recovery_init_sync_method"] = "syncfs"
    return settings


def as_configuration(settings: Mapping[str, str]) -> str:
    """The text of a configuration file that PostgreSQL reads."""
    quoted = {name: value.replace("\\", "\\\\").replace("'", "''") for name, value in settings.items()}
    return "".join(f"{name} = '{value}'\n" for name, value in quoted.items())
