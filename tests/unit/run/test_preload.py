"""Tests that the fork server imports all modules that runs need, before the first run."""

import subprocess
import sys
from pathlib import Path

from simscen.cli.session import fork_server_main
from simscen.spec.base import Component

SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}]
robot: {pose: {x: 1, y: 1}}
goals: [{name: desk, pose: {x: 1.5, y: 1}}]
time_limit: 6
pass: [{goals_reached: {}}]
"""
PROGRAM = """\
import sys
from pathlib import Path
from simscen.cli.session import fork_server_main
from simscen.loading.scenario import load_scenario
from simscen.run.process.jobs import Job
from simscen.stack.costmap import static_layer

folder = Path(sys.argv[1])
loaded = load_scenario(folder / "a.scenario.yaml", folder)
job = Job(0, loaded, loaded.key(1), folder, 60.0)
fork_server_main._warm_up(job)
before = set(sys.modules)
static_layer._unrotated_cells = None  # cached by the warm-up, so a run must not call it
assert fork_server_main._execute(job, lambda seconds: None)["outcome"] == "passed"
print("late:", *sorted(name for name in set(sys.modules) - before if name.split(".")[0] in ("simscen", "ompl", "PIL")))
"""


def test_run_after_the_warm_up_imports_no_modules_and_computes_no_walls(tmp_path: Path) -> None:
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path)], capture_output=True, text=True, check=True, timeout=120
    )
    assert "late:\n" in result.stdout


def test_components_of_plugins_are_not_preloaded() -> None:
    class PluginComponent(Component):
        component = "missing_package.module:PluginComponent"

    class ShippedComponent(Component):
        component = "simscen.sensors.imu:ImuSensor"
        inner: PluginComponent = PluginComponent()

    assert [found.component for found in fork_server_main._components([{"a": (ShippedComponent(),)}])] == [
        ShippedComponent.component,
        PluginComponent.component,
    ]
    assert list(fork_server_main.shipped_modules([ShippedComponent(), PluginComponent()])) == ["simscen.sensors.imu"]
