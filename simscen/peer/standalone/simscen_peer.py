"""Module that loads the package simscen.peer under the name `simscen_peer`, for a Python without simscen.

A stack adds this folder to `sys.path` and uses `import simscen_peer`.
"""

import importlib.util
import sys
from pathlib import Path

_FOLDER = Path(__file__).resolve().parents[1]
_SPEC = importlib.util.spec_from_file_location(
    __name__, str(_FOLDER / "__init__.py"), submodule_search_locations=[str(_FOLDER)]
)
assert _SPEC is not None and _SPEC.loader is not None
_PACKAGE = importlib.util.module_from_spec(_SPEC)
sys.modules[__name__] = _PACKAGE
_SPEC.loader.exec_module(_PACKAGE)
