"""Starts the adapter, which connects a run with ROS 2 nodes, in the user's ROS Python: `python start.py OPTIONS`.

OPTIONS is an `Options` (see options.py) as JSON.

simscen is not installed in that Python. The program makes simscen's folder importable as the package `simscen`, without
running its `__init__.py`.
"""

import json
import sys
import types
from pathlib import Path


def start() -> int:
    """Run the adapter; return its exit code."""
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    package = types.ModuleType("simscen")
    package.__path__ = [str(here.parent)]
    sys.modules["simscen"] = package
    from simscen.ros2.main import main

    return main(json.loads(sys.argv[1]))


if __name__ == "__main__":
    sys.exit(start())
