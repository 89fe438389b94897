"""Where a session runs: all that may differ between two sessions with equal results."""

import json
import os
import platform
import sys
from datetime import datetime, timezone

from simscen.run.versions import arithmetic, cpu_flags, versions


def as_json(wall: float | None = None) -> bytes:
    """run.json; `wall` is how many seconds the session took, None while it is under way."""
    return json.dumps(
        {
            "written": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "wall_seconds": None if wall is None else round(wall, 3),
            "host": platform.node(),
            "command": sys.argv,
            "machine": platform.machine(),
            "cores": os.cpu_count(),
            "cpu_flags": cpu_flags(),
            "arithmetic": arithmetic(),
            "packages": versions(),
        },
        indent=2,
    ).encode()
