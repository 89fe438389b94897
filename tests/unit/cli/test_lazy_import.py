import subprocess
import sys

LATER = """
import sys
from simscen.cli.lazy_import import import_lazily
import_lazily("{name}")
import {name} as early
assert "{probe}" not in sys.modules
{use}
assert "{probe}" in sys.modules
import {name} as late
assert late.__file__ == early.__file__
"""


def _run(name: str, probe: str, use: str) -> None:
    code = LATER.format(name=name, probe=probe, use=use)
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_library_is_imported_when_it_is_first_used() -> None:
    _run("numpy", "numpy.linalg", "assert early.hypot(3, 4) == 5 and early.random.default_rng(1).random() < 1")


def test_a_library_is_imported_when_a_part_of_it_is() -> None:
    _run("numpy", "numpy.linalg", "import numpy.typing as npt; assert npt.NDArray[early.float64]")


def test_a_library_that_is_there_already_stays() -> None:
    subprocess.run(
        [
            sys.executable,
            "-c",
            "import json; from simscen.cli.lazy_import import import_lazily as l; l('json'); json.dumps(1)",
        ],
        check=True,
    )


def test_a_function_can_be_imported_without_the_library_until_it_is_called() -> None:
    code = """
import sys
from simscen.cli.lazy_import import import_lazily
import_lazily("importlib.metadata", "entry_points")
from importlib.metadata import entry_points
import importlib
assert "email" not in sys.modules
assert entry_points(group="console_scripts").names
assert "email" in sys.modules and importlib.metadata.version("simscen")
from importlib.metadata import distribution
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_another_name_of_such_a_library_brings_all_of_it() -> None:
    code = """
from simscen.cli.lazy_import import import_lazily
import_lazily("importlib.metadata", "entry_points")
import importlib.metadata
from importlib.metadata import entry_points
assert importlib.metadata.version("simscen") and entry_points(group="console_scripts").names
"""
    subprocess.run([sys.executable, "-c", code], check=True)
