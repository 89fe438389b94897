"""Growth of the CPU time per simulated second: the patrol with more of one quantity at a time."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.bench.speed.run_speed import PATROL, ProgressCallback, no_progress, timed_run
from simscen.loading.goals import scenario_goals
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare

DURATION_S = 15
"""Simulated time of each run."""
QUANTITIES = {
    "obstacles": (0, 100, 1000),
    "objects": (20, 100),
    "moving objects": (5, 20),
    "beams": (90, 360, 1440),
    "particles": (500, 2000, 8000),
    "robots": (2, 4),
}
"""Quantities that are varied, and their values."""
ROBOT = PATROL.parent.parent / "robots" / "turtlebot.robot.yaml"
OBJECTS_PER_ROW = 25
"""Number of objects in a row behind the patrol's hall, 0.6 m apart."""
UNIT = "ms a simulated second"


def measure_growth(rounds: int, report_progress: ProgressCallback = no_progress) -> Measurements:
    """Return the CPU time per simulated second for each value, as median of several runs."""
    figures: Measurements = {}
    with TemporaryDirectory() as folder:
        for quantity, counts in QUANTITIES.items():
            for count in counts:
                report_progress(f"{count} {quantity}")
                prepared = prepare(load_scenario(write_scaled_patrol(Path(folder), quantity, count), Path(folder)))
                timed_run(prepared)  # the first run pays for caches
                runs = [timed_run(prepared) for _ in range(rounds)]
                costs = [1e3 * cpu / simulated for simulated, cpu, _ in runs]
                figures[f"{count} {quantity}"] = Measurement.of(costs, UNIT)
    return figures


def write_scaled_patrol(folder: Path, quantity: str, count: int) -> Path:
    """Write the patrol as a scenario file with `count` of the quantity `quantity`."""
    text = PATROL.read_text(encoding="utf-8").replace("time_limit: 60 s", f"time_limit: {DURATION_S} s")
    match quantity:
        case "obstacles":
            text = text.replace("  obstacles:\n", "  obstacles:\n" + _crates(count, ""))
        case "objects":  # these could be pushed
            text = text.replace("  objects:\n", "  objects:\n" + _crates(count, ", mass: 5 kg"))
        case "moving objects":
            move = ", move: {{through: [[{there}, {y}]], speed: 0.2 m/s, repeat: back_and_forth}}"
            text = text.replace("  objects:\n", "  objects:\n" + _crates(count, move))
        case "beams":
            robot = ROBOT.read_text(encoding="utf-8").replace("beams: 360", f"beams: {count}")
            (folder / "robot.robot.yaml").write_text(robot, encoding="utf-8")
            text = text.replace("robot: {pose", "robot: {model: robot.robot.yaml, pose")
        case "particles":
            text += (
                f"stack: {{localizer: {{type: scan_matching_amcl, min_particles: {count}, max_particles: {count}}}}}\n"
            )
        case _:
            text = re.sub(r"^robot:.*?^(?=time_limit)", _robots(count), text, flags=re.DOTALL | re.MULTILINE)
    file = folder / f"{quantity.replace(' ', '_')}_{count}.scenario.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def _crates(count: int, more: str) -> str:
    """Return the YAML of crates. `more` are further keys, with {there} for x + 0.2 m and {y}."""
    return "".join(
        f"    - {{name: crate {n}, box: [0.3, 0.3, 0.4], pose: {{x: {x}, y: {y}}}"
        f"{more.format(there=round(x + 0.2, 2), y=y)}}}\n"
        for n, x, y in _crate_positions(count)
    )


def _crate_positions(count: int) -> Iterator[tuple[int, float, float]]:
    for number in range(count):
        row, column = divmod(number, OBJECTS_PER_ROW)
        yield number, round(0.5 + 0.6 * column, 2), round(11.0 + 0.6 * row, 2)


def _robots(count: int) -> str:
    """Return the YAML of `count` robots that start in a column. Each begins with another goal of the patrol."""
    goals = scenario_goals(load_scenario(PATROL, PATROL.parent).spec)
    poses = [{"x": goal.pose.x, "y": goal.pose.y, "yaw": goal.pose.yaw} for goal in goals]
    robots = {
        f"robot_{number}": {
            "pose": {"x": 1.0, "y": 1.2 + 1.2 * number, "yaw": 0.0},
            "goals": [{"pose": pose} for pose in (*poses[number:], *poses[:number])],
        }
        for number in range(count)
    }
    return f"robots: {json.dumps(robots)}\n"
