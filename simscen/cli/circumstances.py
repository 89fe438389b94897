"""Where a session runs: all that may differ between two sessions with equal results."""

import json
import os
import platform
import sys
from collections.abc import Mapping
from datetime import datetime, timezone

from simscen.run.versions import arithmetic, cpu_flags, versions


def as_json(used: Mapping[str, object], wall: float | None = None) -> bytes:
    """run.json; `used` are installed packages and external stacks, `wall` the seconds that the session took.

    While it is under way `wall` is None.
    """
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
            **used,
        },
        indent=2,
    ).encode()
