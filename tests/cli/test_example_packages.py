"""Tests of two example packages, a planner and a stack: contract tests and runs on the command line."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLUGINS = ROOT / "tests" / "plugins"
SIMSCEN = "import sys; from simscen.cli.start import start; sys.exit(start())"
NAMES = ("theta_star", "vfh_plus")


@pytest.fixture
def call(tmp_path: Path, install_folder):
    """Calls Python where both packages are installed."""
    site = tmp_path / "site"
    for name in NAMES:
        install_folder(PLUGINS / name, site)
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), str(ROOT)])}

    def run(*arguments: str, folder: Path = ROOT) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *arguments], cwd=folder, env=env, capture_output=True, text=True, check=False
        )

    return run


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_tests_of_example_package_pass(call, name: str) -> None:
    pytest_ = ("-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", "--import-mode=importlib", "-o", "addopts=")
    done = call(*pytest_, "tests", folder=PLUGINS / name)
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_contract_tests_accept_an_entry_point_name(call, tmp_path: Path) -> None:
    plugin = ("-p", "no:simscen", "-p", "simscen.testing.plugin")  # whether or not this simscen was installed anew
    asked = ("-k", "without and goal and zero", "--simscen-contract", "vfh_plus")
    pytest_ = ("-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *plugin, *asked)
    done = call(*pytest_, folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout


@pytest.mark.slow
@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("stack", "used", "scenarios"),
    [
        (
            "{planner: {type: theta_star}}",
            "theta-star",
            ("navigation/path_length", "corner_cases/person_stops_in_front"),
        ),
        ("{type: vfh_plus}", "vfh-plus", ("navigation/goal", "obstacles/cart_crossing", "obstacles/pallet_on_plan")),
    ],
    ids=NAMES,
)
def test_shipped_scenarios_pass_with_it_twice_with_equal_logs(
    call, tmp_path: Path, stack: str, used: str, scenarios
) -> None:
    (tmp_path / "theirs.stack.yaml").write_text(f"simscen: 1\nstack: {stack}\n")
    files = [f"scenarios/{name}.scenario.yaml" for name in scenarios]
    chosen = ("--stack", f"theirs={tmp_path}/theirs.stack.yaml", "--check-determinism", "--out", str(tmp_path / "out"))
    done = call("-c", SIMSCEN, "run", *files, *chosen)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{2 * len(scenarios)} passed" in done.stdout
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["plugins"].keys() == {used}


@pytest.mark.slow
def test_keys_of_the_package_are_explained_and_in_the_schema(call) -> None:
    assert "Lazy Theta*" in call("-c", SIMSCEN, "explain", "theta_star").stdout
    assert "Room that is kept around the hull." in call("-c", SIMSCEN, "explain", "vfh_plus").stdout
    schema = call("-c", SIMSCEN, "schema").stdout
    assert '"const": "theta_star"' in schema
    assert '"const": "vfh_plus"' in schema


def test_validation_does_not_import_component_implementations(call, tmp_path: Path) -> None:
    text = (ROOT / "scenarios/navigation/goal.scenario.yaml").read_text().replace("../../worlds", "../worlds")
    shutil.copytree(ROOT / "worlds", tmp_path / "worlds")
    (tmp_path / "scenarios").mkdir()
    for name, stack in (("a", "{planner: {type: theta_star}}"), ("b", "{type: vfh_plus}")):
        (tmp_path / "scenarios" / f"{name}.scenario.yaml").write_text(f"{text}stack: {stack}\n")
    heavy = "{'ompl', 'scipy', 'pybullet', 'theta_star.planner', 'vfh_plus.stack', 'theta_star.spec', 'vfh_plus.spec'}"
    probe = f"import os, sys; os._exit = lambda code: print(code, *sorted({heavy} & set(sys.modules)));"
    done = call("-c", probe + SIMSCEN, "validate", ".", folder=tmp_path)
    expected = ["2 scenarios and 5 worlds are valid", "0 theta_star.spec vfh_plus.spec"]
    assert done.stdout.splitlines() == expected, done.stderr


BROKEN = """
from simscen.plugin import Path, PlannerSpec


class Nan(PlannerSpec):
    component = "nan_planner:Planner"


class Planner:
    def __init__(self, spec, setting):
        pass

    def plan(self, costmap, start, goal, seed):
        if seed % 2:
            raise ZeroDivisionError("half way")
        return Path([[0.0, 0.0, float("nan")]])
"""


@pytest.mark.slow
def test_broken_planner_is_an_error_of_its_run_only(call, install, tmp_path: Path) -> None:
    install(tmp_path / "site", "nan-planner", "0.9", {"planner": {"nan": "nan_planner:Nan"}}, nan_planner=BROKEN)
    (tmp_path / "nan.stack.yaml").write_text("simscen: 1\nstack: {planner: {type: nan}}\n")
    stacks = ("--stack", f"nan={tmp_path}/nan.stack.yaml", "--stack", "reference=reference")
    done = call(
        "-c", SIMSCEN, "run", "scenarios/navigation/goal.scenario.yaml", *stacks, "--out", str(tmp_path / "out")
    )
    assert done.returncode == 3, done.stdout + done.stderr
    assert "1 passed, 1 error" in done.stdout
    junit = (tmp_path / "out" / "junit.xml").read_text()
    assert "planner `nan` (nan_planner:Planner)" in junit
    assert 'type="crashed"' in junit or 'type="broken-component"' in junit
    assert "(nan_planner.py:15)" in junit or "whose points are list" in junit
