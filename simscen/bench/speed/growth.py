"""Measurement of the CPU time per simulated second of variants of the scenario PATROL that differ in size."""

import json
import re
from pathlib import Path
from tempfile import TemporaryDirectory

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.bench.speed.run_speed import PATROL, ProgressCallback, time_run
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
"""Values of the quantities that are varied. Each variant of PATROL changes one quantity."""
ROBOT = PATROL.parent.parent / "robots" / "turtlebot.robot.yaml"
"""Robot of PATROL."""
OBJECTS_PER_ROW = 25
"""Number of crates in a row. All rows are outside of the hall of PATROL."""


def measure_growth(rounds: int, report_progress: ProgressCallback) -> Measurements:
    """Return the CPU time per simulated second for each value of QUANTITIES. Each is the median of `rounds` runs."""
    figures: Measurements = {}
    with TemporaryDirectory() as folder:
        for quantity, counts in QUANTITIES.items():
            for count in counts:
                report_progress(f"{count} {quantity}")
                prepared = prepare(load_scenario(write_scaled_patrol(Path(folder), quantity, count), Path(folder)))
                time_run(prepared)  # the first run pays for caches
                runs = [time_run(prepared) for _ in range(rounds)]
                costs = [1e3 * run.cpu / run.simulated for run in runs]
                figures[f"{count} {quantity}"] = Measurement.from_rounds(costs, "ms per simulated second")
    return figures


def write_scaled_patrol(folder: Path, quantity: str, count: int) -> Path:
    """Write PATROL with the value `count` of a quantity (a key of QUANTITIES), and return the scenario file."""
    text = PATROL.read_text(encoding="utf-8").replace("time_limit: 60 s", f"time_limit: {DURATION_S} s")
    match quantity:
        case "obstacles":
            text = text.replace("  obstacles:\n", "  obstacles:\n" + _crates(count, ""))
        case "objects":  # the robot can push these crates
            text = text.replace("  objects:\n", "  objects:\n" + _crates(count, ", mass: 5 kg"))
        case "moving objects":
            move = ", move: {{through: [[{end_x}, {y}]], speed: 0.2 m/s, repeat: back_and_forth}}"
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


def _crates(count: int, extra_keys: str) -> str:
    """Return the YAML of crates. `extra_keys` are further YAML keys of each crate.

    In `extra_keys`, {y} is replaced by the y of the crate, and {end_x} by the x of the crate plus 0.2 m.
    """
    lines = []
    for number in range(count):
        row, column = divmod(number, OBJECTS_PER_ROW)
        x, y = round(0.5 + 0.6 * column, 2), round(11.0 + 0.6 * row, 2)
        keys = extra_keys.format(end_x=round(x + 0.2, 2), y=y)
        lines.append(f"    - {{name: crate {number}, box: [0.3, 0.3, 0.4], pose: {{x: {x}, y: {y}}}{keys}}}\n")
    return "".join(lines)


def _robots(count: int) -> str:
    """Return the YAML of `count` robots with the goals of PATROL. Each robot starts with a different goal."""
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
