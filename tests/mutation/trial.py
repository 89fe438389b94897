"""Tries one mutant: a process of its own in which the module is the mutant, and the tests that concern it."""

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
EXAMPLES = 25
"""Of Hypothesis, drawn in the same way each time: a mutant is killed or not, not by chance."""
PATIENCE = 10.0
"""A mutant that takes so many times as long as the tests without one never ends, and is dead."""
LEAST = 2.0
"""Seconds that each has at least."""


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


def survives(name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float) -> bool:
    """Whether the tests pass with this tree for the module `name`, in `limit` seconds of computing."""
    return tried(name, file, tree, tests, limit)[0]


def tried(name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float = math.inf) -> tuple[bool, float]:
    """Whether the tests pass with this tree: golden cases by kind, or what pytest takes; and the limit that this sets.

    What counts is the time the processor worked for it: how busy the machine is makes no difference.
    """
    child = os.fork()
    if child == 0:
        _try(name, file, tree, tests, limit)
    _, status, used = os.wait4(child, 0)
    return status == 0, max(LEAST, PATIENCE * (used.ru_utime + used.ru_stime))


def _try(name: str, file: Path, tree: ast.Module, tests: Sequence[str], limit: float) -> None:
    code = 1
    try:
        if math.isfinite(limit):
            signal.setitimer(signal.ITIMER_PROF, limit)
        sys.meta_path.insert(0, Mutated(name, file, tree))
        if tests[0] == GOLDEN:
            _golden(tests[1:])
            code = 0
            return
        from hypothesis import Phase, settings

        phases = (Phase.explicit, Phase.generate)  # the first example that fails will do, however large
        settings.register_profile(
            "mutation", max_examples=EXAMPLES, derandomize=True, database=None, deadline=None, phases=phases
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


def _golden(kinds: Sequence[str]) -> None:
    """The golden cases of these criteria, of all for none; without pytest, which takes ten times as long to begin."""
    spec = importlib.util.spec_from_file_location("golden", GOLDEN_CASES)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for of, case in module.CASES:
        if not kinds or of in kinds:
            module.test_a_criterion_answers_as_its_golden_case_says(of, case)
