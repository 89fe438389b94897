"""Lets the tests of this folder share the random formulas of tests/unit/criteria/stl."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "criteria" / "stl"))
