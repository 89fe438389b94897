import subprocess
import sys

LATER = """
import sys
from simscen.cli.later import import_later
import_later("{name}")
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
            "import json; from simscen.cli.later import import_later as l; l('json'); json.dumps(1)",
        ],
        check=True,
    )
