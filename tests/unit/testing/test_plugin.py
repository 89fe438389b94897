"""Tests of `pytest --simscen-contract` in a separate pytest process."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

OWN_COMPONENT = """
from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import model_validator

from simscen.model.controllers import GoalCheckerSpec

if TYPE_CHECKING:
    from simscen.stack.setting import Setting


class Spec(GoalCheckerSpec):
    component = "own:Checker"
    part: float


class Checker:
    def __init__(self, spec: Spec, setting: Setting):
        self.part = spec.part

    def reset(self):
        pass

    def reached(self, goal, pose, twist):
        from simscen.core.geometry import wrap

        near = goal.pose.distance(pose) <= self.part * goal.xy_tolerance
        return near and abs(wrap(goal.pose.yaw - pose.yaw)) <= goal.yaw_tolerance


class Raising(Spec):
    @model_validator(mode="after")
    def check(self):
        raise KeyError("k")


class Unannotated:
    def __init__(self, spec, setting):
        pass
"""


@pytest.fixture
def run(tmp_path: Path):
    """Return a function that runs pytest in a folder with the module `own` and a test, and returns code and output."""
    (tmp_path / "own.py").write_text(OWN_COMPONENT)
    (tmp_path / "test_project.py").write_text("def test_project():\n    pass\n")

    def call(*arguments: str, probe: str = "pass") -> tuple[int, str]:
        code = f"import sys, pytest; sys.path.insert(0, '.'); code = pytest.main(sys.argv[1:]); {probe}; sys.exit(code)"
        plugin = ("-p", "no:simscen", "-p", "simscen.testing.plugin", "-p", "no:cacheprovider")
        result = subprocess.run([sys.executable, "-c", code, *plugin, *arguments],
                              cwd=tmp_path, capture_output=True, text=True, check=False)  # fmt: skip
        return result.returncode, result.stdout + result.stderr

    return call


def test_contract_run_collects_only_the_promises_of_the_component(run) -> None:
    code, output = run("-v", "-p", "no:xdist", "--simscen-contract", 'own:Checker={"part": 0.9}')
    assert code == 0, output
    assert "a reset forgets the goal before" in output
    assert "6 passed" in output
    assert "test_project" not in output


@pytest.mark.slow
def test_broken_promise_reports_observed_and_promised_behavior(run) -> None:
    code, output = run("-p", "no:xdist", "--simscen-contract", 'own:Spec={"part": 3.0}', "test_project.py")
    assert code == 1, output
    assert "says that a robot at (2.26, -1.0, 0.5) has reached (2.0, -1.0, 0.5)" in output
    assert "promised: Given a robot outside a tolerance of the goal" in output
    assert "Traceback" not in output
    assert "1 failed, 6 passed" in output  # includes the test of the given path


@pytest.mark.slow
def test_contract_accepts_the_name_of_a_shipped_type_and_xdist_workers(run) -> None:
    code, output = run("-n1", "--simscen-contract", "simple", "-k", "reset")
    assert code == 0, output
    assert "1 passed" in output


def test_mistake_is_readable_with_xdist_workers(run) -> None:
    code, output = run("-n1", "--simscen-contract", "headless")
    assert code == 4, output
    assert output.strip().splitlines()[-1].startswith("ERROR: --simscen-contract headless: no installed package")


def test_two_targets_with_other_values_have_different_test_ids(run) -> None:
    targets = [f'own:Checker={{"part": {part}}}' for part in (0.8, 0.9)]
    options = [option for target in targets for option in ("--simscen-contract", target)]
    code, output = run("--collect-only", "-q", "-p", "no:xdist", *options)
    assert code == 0, output
    ids = [line for line in output.splitlines() if "::" in line]
    assert len(ids) == len(set(ids)) == 12


INVALID_TARGETS = {
    "own:Checker": "part: Field required",
    "own:Checker={part: 1}": "is not valid JSON",
    'own:Raising={"part": 1}': "Raising: KeyError: 'k'",
    "own:Unannotated": "its first argument is not annotated with a specification",
    "own:Nothing": "has no attribute 'Nothing'",
    "nowhere:Nothing": "No module named 'nowhere'",
    "headless": "no installed package adds anything of that name",
    "builtins:dict": "its first argument is not annotated with a specification",
    ":Nothing": "Empty module name",
}
INVALID_LIMITS = ("0", "-1", "nan", "soon")
RUN_EACH_ARGUMENT = """
import contextlib, io, json, sys
import pytest
sys.path.insert(0, ".")
plugin = ("-p", "no:simscen", "-p", "simscen.testing.plugin", "-p", "no:cacheprovider", "-p", "no:xdist")
outputs = {}
for argument in sys.argv[1:]:
    with io.StringIO() as text, contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        code = pytest.main([*plugin, argument])
        outputs[argument] = (int(code), text.getvalue())
print(json.dumps(outputs))
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """Return exit code and output for each invalid argument, from one process that runs pytest for all of them."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "own.py").write_text(OWN_COMPONENT)
    arguments = [f"--simscen-contract={target}" for target in INVALID_TARGETS]
    arguments += [f"--simscen-contract-limit={limit}" for limit in INVALID_LIMITS]
    command = [sys.executable, "-c", RUN_EACH_ARGUMENT, *arguments]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    outputs: dict[str, tuple[int, str]] = json.loads(result.stdout)
    return outputs


@pytest.mark.sample(2)
@pytest.mark.parametrize("target", INVALID_TARGETS)
def test_untestable_target_is_a_readable_error(results, target: str) -> None:
    code, output = results[f"--simscen-contract={target}"]
    assert code == 4
    assert INVALID_TARGETS[target] in output
    assert "Traceback" not in output


@pytest.mark.parametrize("limit", INVALID_LIMITS)
def test_limit_must_be_positive(results, limit: str) -> None:
    code, output = results[f"--simscen-contract-limit={limit}"]
    assert code == pytest.ExitCode.USAGE_ERROR
    assert f"argument --simscen-contract-limit: {limit!r} is not a positive number of seconds" in output


def test_pytest_without_a_contract_imports_only_the_plug_in_of_simscen(run) -> None:
    probe = "print('loaded', *sorted(m for m in sys.modules if m.startswith('simscen') or m in ('numpy', 'pydantic')))"
    code, output = run("-q", "-p", "no:xdist", probe=probe)
    assert code == 0, output
    imported = output.splitlines()[-1].split()[1:]
    modules = ["core", "core.version", "pytesting", "pytesting.plugin", "testing", "testing.plugin"]
    assert imported == ["simscen", *(f"simscen.{name}" for name in modules)]
