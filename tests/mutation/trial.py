"""Tries one mutant: a process of its own in which the module is the mutant, and the tests that concern it."""

import ast
import contextlib
import importlib.abc
import importlib.util
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import pytest

PYTEST = [
    *("-o", "addopts=", "-o", "filterwarnings=", "--import-mode=importlib", "--assert=plain"),
    *("-p", "no:xdist", "-p", "no:cacheprovider", "-x", "-q"),
]
GOLDEN = "golden"
GOLDEN_CASES = Path(__file__).parents[1] / "unit/judge/test_golden_cases.py"
EXAMPLES = 25
"""Of Hypothesis, drawn in the same way each time: a mutant is killed or not, not by chance."""
TIMEOUT = 60
"""Seconds; a mutant that never ends is dead."""


class Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports `name` from a changed tree."""

    def __init__(self, name: str, file: Path, tree: ast.Module) -> None:
        self._name, self._file, self._tree = name, file, tree

    def find_spec(self, name, path=None, target=None):
        """Only this module."""
        if name != self._name:
            return None
        return importlib.util.spec_from_file_location(name, self._file, loader=self)

    def create_module(self, spec) -> ModuleType | None:
        """As usual."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        """Run the changed tree."""
        exec(compile(self._tree, self._file, "exec"), module.__dict__)


def survives(name: str, file: Path, tree: ast.Module, tests: Sequence[str]) -> bool:
    """Whether the tests pass with this tree for the module `name`: golden cases by kind, or what pytest takes."""
    child = os.fork()
    if child == 0:
        _try(name, file, tree, tests)
    _, status = os.waitpid(child, 0)
    return status == 0


def _try(name: str, file: Path, tree: ast.Module, tests: Sequence[str]) -> None:
    code = 1
    try:
        signal.alarm(TIMEOUT)
        sys.meta_path.insert(0, Mutated(name, file, tree))
        if tests[0] == GOLDEN:
            _golden(tests[1])
            code = 0
            return
        from hypothesis import settings

        settings.register_profile("mutation", max_examples=EXAMPLES, derandomize=True, database=None, deadline=None)
        settings.load_profile("mutation")
        with (
            Path(os.devnull).open("w") as silent,
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
        ):
            code = int(pytest.main([*PYTEST, *tests]))
    finally:
        os._exit(code)


def _golden(kind: str) -> None:
    """The golden cases of a criterion ("" = of all) without pytest, which takes ten times as long to begin."""
    spec = importlib.util.spec_from_file_location("golden", GOLDEN_CASES)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for of, case in module.CASES:
        if kind in ("", of):
            module.test_a_criterion_answers_as_its_golden_case_says(of, case)
