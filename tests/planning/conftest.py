"""Lets the tests of this folder import generated_worlds."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
