"""Tests of `import_lazily`, which delays the import of a library until its first use."""

import subprocess
import sys

PROGRAM = """
import sys
from simscen.cli.main import import_lazily
import_lazily("{name}")
import {name} as early
assert "{probe}" not in sys.modules
{use}
assert "{probe}" in sys.modules
import {name} as late
assert late.__file__ == early.__file__
"""


def run_program(name: str, probe: str, use: str) -> None:
    code = PROGRAM.format(name=name, probe=probe, use=use)
    subprocess.run([sys.executable, "-c", code], check=True)


def test_library_is_imported_on_first_use() -> None:
    run_program("numpy", "numpy.linalg", "assert early.hypot(3, 4) == 5 and early.random.default_rng(1).random() < 1")


def test_library_is_imported_with_its_submodule() -> None:
    run_program("numpy", "numpy.linalg", "import numpy.typing as npt; assert npt.NDArray[early.float64]")


def test_library_that_is_already_imported_is_kept() -> None:
    subprocess.run(
        [
            sys.executable,
            "-c",
            "import json; from simscen.cli.main import import_lazily as l; l('json'); json.dumps(1)",
        ],
        check=True,
    )


def test_lazy_function_imports_the_library_when_called() -> None:
    code = """
import sys
from simscen.cli.main import import_lazily
import_lazily("importlib.metadata", "entry_points")
from importlib.metadata import entry_points
import importlib
assert "email" not in sys.modules
assert entry_points(group="console_scripts").names
assert "email" in sys.modules and importlib.metadata.version("simscen")
from importlib.metadata import distribution
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_other_attribute_of_a_library_with_a_lazy_function_imports_the_library() -> None:
    code = """
from simscen.cli.main import import_lazily
import_lazily("importlib.metadata", "entry_points")
import importlib.metadata
from importlib.metadata import entry_points
assert importlib.metadata.version("simscen") and entry_points(group="console_scripts").names
"""
    subprocess.run([sys.executable, "-c", code], check=True)
