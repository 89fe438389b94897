"""Run tests with a mutant in place of a module, in a process of its own."""

import ast
import contextlib
import importlib.abc
import importlib.util
import math
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
MAX_EXAMPLES = 25
"""Number of examples of Hypothesis. They are the same each time, so that the result is deterministic."""
LIMIT_FACTOR = 10.0
"""CPU time limit of a mutant, divided by the CPU time of the tests without it. A mutant that exceeds it is killed."""
MIN_LIMIT_S = 2.0
"""Smallest CPU time limit."""


class MutantImporter(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Import hook that loads the module `name` from a changed syntax tree."""

    def __init__(self, name: str, file: Path, tree: ast.Module) -> None:
        self._name, self._file, self._tree = name, file, tree

    def find_spec(self, name, path=None, target=None):
        """Return the spec of the module `name`, and None for other modules."""
        if name != self._name:
            return None
        return importlib.util.spec_from_file_location(name, self._file, loader=self)

    def create_module(self, spec) -> ModuleType | None:
        """Return None: the module object is created as usual."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        """Execute the changed tree."""
        exec(compile(self._tree, self._file, "exec"), module.__dict__)


def survives(name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float) -> bool:
    """Return whether the tests pass with `tree` as the module `name`, within `limit` s of CPU time."""
    return run_tests(name, file, tree, tests, limit)[0]


def run_tests(
    name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float = math.inf
) -> tuple[bool, float]:
    """Run tests with `tree` as the module `name`; return whether they pass, and the limit for mutants in s.

    `tests` are arguments of pytest, or GOLDEN and names of criteria. Limits are CPU times, so that the result does not
    depend on the load of the machine.
    """
    child = os.fork()
    if child == 0:
        _run_in_child(name, file, tree, tests, limit)
    _, status, used = os.wait4(child, 0)
    return status == 0, max(MIN_LIMIT_S, LIMIT_FACTOR * (used.ru_utime + used.ru_stime))


def _run_in_child(name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float) -> None:
    """Run the tests, and end this process with exit code 0 if they pass."""
    code = 1
    try:
        if math.isfinite(limit):
            signal.setitimer(signal.ITIMER_PROF, limit)
        sys.meta_path.insert(0, MutantImporter(name, file, tree))
        if tests[0] == GOLDEN:
            _run_golden_cases(tests[1:])
            code = 0
            return
        from hypothesis import Phase, settings

        phases = (Phase.explicit, Phase.generate)  # failing examples need not be shrunk
        settings.register_profile(
            "mutation", max_examples=MAX_EXAMPLES, derandomize=True, database=None, deadline=None, phases=phases
        )
        settings.load_profile("mutation")
        with (
            Path(os.devnull).open("w") as silent,
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
        ):
            code = int(pytest.main([*PYTEST, *tests]))
    finally:
        os._exit(code)


def _run_golden_cases(criteria: Sequence[str]) -> None:
    """Run the golden cases of these criteria, or all if none is given, without pytest, whose start takes longer."""
    spec = importlib.util.spec_from_file_location("golden", GOLDEN_CASES)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for criterion, case in module.CASES:
        if not criteria or criterion in criteria:
            module.test_verdict_equals_that_of_the_golden_case(criterion, case)
