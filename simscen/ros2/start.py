"""What the ROS Python runs, by its path: `python start.py OPTIONS`, with the options as JSON.

simscen is not installed there, and need not be: its folder stands in for the package, whose own `__init__` is not run.
"""

import json
import sys
import types
from pathlib import Path


def start() -> int:
    """Run the adapter; its exit code."""
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    package = types.ModuleType("simscen")
    package.__path__ = [str(here.parent)]
    sys.modules["simscen"] = package
    from simscen.ros2.main import main

    return main(json.loads(sys.argv[1]))


if __name__ == "__main__":
    sys.exit(start())
