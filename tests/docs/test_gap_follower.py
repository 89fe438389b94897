"""Tests of the C++ example of the stack protocol."""

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.core.external_command import ExternalCommand
from simscen.core.records.run_result import Outcome
from simscen.loading.scenario import load_scenario
from simscen.model.stack_files import ExternalStackSpec
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "docs/examples/gap_follower.cpp"


@pytest.fixture(scope="module")
def follower(tmp_path_factory: pytest.TempPathFactory) -> ExternalCommand:
    if shutil.which("g++") is None:
        pytest.skip("there is no g++ to build docs/examples/gap_follower.cpp with")
    folder = tmp_path_factory.mktemp("cpp")
    options = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-o", str(folder / "gap_follower")]
    subprocess.run(["g++", *options, str(SOURCE)], check=True)
    return ExternalCommand((str(folder / "gap_follower"),), dict(os.environ), str(folder))


@pytest.mark.parametrize("name", ["navigation/goal", pytest.param("robots/mecanum_errand", marks=pytest.mark.slow)])
def test_gap_follower_drives_a_shipped_scenario(follower: ExternalCommand, name: str) -> None:
    prepared = prepare(load_scenario(ROOT / f"scenarios/{name}.scenario.yaml", ROOT))
    stack = ExternalStackSpec(external="gaps")
    run = simulate(replace(prepared, stack=stack, loaded=replace(prepared.loaded, external_command=follower)))
    assert run.result.outcome is Outcome.PASSED
    assert run.result.ended == "navigation ended"
    assert len(run.trace.belief) > 100


def test_gap_follower_without_simscen_prints_a_hint(follower: ExternalCommand) -> None:
    ended = subprocess.run(follower.argv, env={}, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr == "gap_follower: SIMSCEN_STACK_FD is not set: start this program with `simscen run --stack`\n"
