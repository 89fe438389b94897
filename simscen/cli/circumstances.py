"""Where a session runs: all that may differ between two sessions with equal results."""

import json
import os
import platform
import sys
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("simscen", "pybullet", "ompl", "filterpy", "numpy", "scipy", "embreex", "mcap", "pydantic")
_LAST_BITS = {"fma", "avx", "avx2", "avx512f", "sse4_2"}
"""The instruction sets that change last bits."""


def as_json(wall: float | None = None) -> bytes:
    """run.json; `wall` is how many seconds the session took, None while it is under way."""
    return json.dumps(
        {
            "written": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "wall_seconds": None if wall is None else round(wall, 3),
            "host": platform.node(),
            "command": sys.argv,
            "python": platform.python_version(),
            "machine": platform.machine(),
            "cores": os.cpu_count(),
            "cpu_flags": cpu_flags(),
            "packages": {name: version(name) for name in PACKAGES},
        },
        indent=2,
    ).encode()


def cpu_flags() -> list[str]:
    """Which of the instruction sets that change last bits this machine has; nothing where Linux does not say."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    flags = next((line.split(":", 1)[1].split() for line in lines if line.startswith("flags")), [])
    return sorted(_LAST_BITS.intersection(flags))
