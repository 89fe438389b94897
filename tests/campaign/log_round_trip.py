"""Round trip of shipped scenarios: run, reconstruct from only the log, and compare both scenarios.

`python tests/campaign/log_round_trip.py [RUNS] [-k TEXT]` prints a table. RUNS is the output folder of
`simscen run scenarios`; without it, the scenarios are run first. Exit code 1 if fewer scenarios agree than required.
"""

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simscen.core.errors import SimscenError
from simscen.core.records.trace import Samples
from simscen.loading.yaml.parser import parse_yaml
from simscen.model.scenario import ScenarioSpec
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.scenario_from_log import Reconstruction, ReconstructionOptions, scenario_from_log
from simscen.record.log_reader import Log, read_log

ROOT = Path(__file__).parents[2]
MAX_POSE_ERROR_M, MAX_OBJECT_RMSE_M, MAX_TIME_ERROR_S = 0.1, 0.3, 0.5
MIN_MOVED_M, MIN_SEEN_S = 0.4, 1.5
MIN_COVERED = 0.5
SAME_KINDS = {
    ("odom", "scale"): {("odom", "bias")},
    ("odom", "bias"): {("odom", "scale")},
    ("wheels", "gain"): {("cmd_vel", "gain"), ("cmd_vel", "saturation")},
    ("odom", "slip"): {("wheels", "slip")},
    ("lidar", "dropout"): {("lidar", "intermittent")},
    ("lidar", "intermittent"): {("lidar", "off")},
}
"""Faults that are equivalent for the robot."""


@dataclass
class Row:
    """Comparison for one scenario; `objects` are RMSE in m, error of the time in s, and share of the time covered.

    `pedestrians` are the objects that are written as pedestrians.
    """

    name: str
    start: float = 0.0
    goals: float = 0.0
    objects: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    ordered: set[tuple[str, str]] = field(default_factory=set)
    found: set[tuple[str, str]] = field(default_factory=set)
    spurious: int = 0
    pedestrians: int = 0
    problem: str = ""

    @property
    def poses_agree(self) -> bool:
        """Whether the start and all goals have the same poses."""
        return not self.problem and max(self.start, self.goals) <= MAX_POSE_ERROR_M

    @property
    def objects_agree(self) -> bool:
        """Whether all moving objects that the lidar saw were found, at the right positions and times."""
        return not self.problem and all(
            rmse <= MAX_OBJECT_RMSE_M and late <= MAX_TIME_ERROR_S and covered >= MIN_COVERED
            for rmse, late, covered in self.objects.values()
        )

    @property
    def missing(self) -> set[tuple[str, str]]:
        """Faults of the scenario that were not found."""
        return {kind for kind in self.ordered if not ({kind, *SAME_KINDS.get(kind, ())} & self.found)}

    @property
    def extra(self) -> set[tuple[str, str]]:
        """Found faults that the scenario does not have."""
        allowed = self.ordered.union(*(SAME_KINDS.get(kind, set()) for kind in self.ordered))
        return self.found - allowed

    @property
    def faults_agree(self) -> bool:
        """Whether the found faults are those of the scenario."""
        return not self.problem and not self.missing and not self.extra


def compare(file: Path, out: Path, truth: str | None = None) -> Row:
    """Reconstruct the scenario of one log, and compare it with the log's own.

    With `truth` "none", use the poses that the robot estimated, as for a real robot.
    """
    log = read_log(file)
    row = Row(log.header.name.removeprefix("scenarios/"))
    try:
        made = scenario_from_log(file, out, ReconstructionOptions(truth, root=ROOT))
    except SimscenError as error:
        row.problem = str(error).splitlines()[0]
        return row
    case = log.header.case
    row.start = case.start.distance(made.contents.start)
    expected = {goal.name.replace("#", " loop "): goal.pose for goal in case.every_goal}
    errors = [goal.pose.distance(expected[goal.name]) for goal in made.contents.goals if goal.name in expected]
    accepted = {event.name for event in log.trace.events if str(event.kind) == "goal.accepted"}
    row.goals = max(errors, default=0.0) if len(errors) >= len(accepted) else float("inf")
    tree, _ = parse_yaml(log.header.scenario, "scenario.yaml")  # not PyYAML, for which the key `off` is a boolean
    assert tree is not None
    spec = ScenarioSpec.model_validate(tree.plain, by_alias=True, by_name=False)
    row.ordered = {(fault.sensor, fault.kind) for fault in spec.faults}
    row.found = {(fault.target, fault.kind) for fault in made.contents.estimated.faults}
    if ("map", "shift") in row.ordered or ("map", "outdated") in row.ordered:
        row.found |= {one for one in row.ordered if one[0] == "map"} if made.contents.given.map else set()
    _compare_objects(row, log, made)
    return row


def _compare_objects(row: Row, log: Log, made: Reconstruction) -> None:
    moved = {name: track for name, track in log.trace.objects.items() if _moved(track)}
    moving = [found for found in made.contents.estimated.objects if found.is_moving]
    for name, track in sorted(moved.items()):
        seen = _times_seen(track, log, made)
        if len(seen) * 0.1 >= MIN_SEEN_S and _moved_while(track, log, seen):
            fits = [_fit(found, track, log, seen) for found in moving]
            row.objects[name] = min(fits, key=_rank, default=(float("inf"), float("inf"), 0.0))
    row.pedestrians = sum(found.pedestrian is not None for found in moving)
    row.spurious = max(0, len(moving) - len(moved))


def _rank(fit: tuple[float, float, float]) -> tuple[bool, float]:
    return fit[2] < MIN_COVERED or fit[0] > MAX_OBJECT_RMSE_M, fit[0]


def _moved(track: Samples) -> bool:
    return float(np.hypot(*np.ptp(track.values[:, :2], axis=0))) > MIN_MOVED_M


def _position(track: Samples, rate: int, times: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, track.ticks / rate, track.values[:, axis]) for axis in (0, 1)])


def _moved_while(track: Samples, log: Log, times: np.ndarray) -> bool:
    return float(np.hypot(*np.ptp(_position(track, log.trace.tick_rate, times), axis=0))) > MIN_MOVED_M


def _times_seen(track: Samples, log: Log, made: Reconstruction) -> np.ndarray:
    """Return the times, every 0.1 s, at which the static world does not hide the center of an object."""
    rate = log.trace.tick_rate
    times = np.arange(track.ticks[0] / rate, min(track.ticks[-1], log.trace.end) / rate, 0.1)
    if not len(times) or made.static_world is None or made.drive.scans is None:
        return times[:0]
    places, robot = _position(track, rate, times), made.drive.poses.poses_at(times)
    offset = places - robot[:, :2]
    distance = np.hypot(*offset.T)
    poses = np.column_stack((robot[:, :2], np.arctan2(offset[:, 1], offset[:, 0])))
    free = made.static_world.ranges_from(poses, np.zeros(1), made.drive.scans.range_max)[:, 0]
    return times[(distance < free) & (distance < 8.0)]


def _fit(found: FoundObject, track: Samples, log: Log, seen: np.ndarray) -> tuple[float, float, float]:
    """Return the RMSE in m, the best time shift in s, and the covered share of the times seen.

    Of a pedestrian, the simulated motion counts, and not the track.
    """
    frames = np.array([frame[:3] for frame in found.keyframes])
    if found.pedestrian is not None:
        frames = np.column_stack((found.pedestrian.times, found.pedestrian.positions))
    inside = seen[(seen >= frames[0, 0]) & (seen <= frames[-1, 0])]
    if len(inside) < 5:
        return float("inf"), float("inf"), 0.0
    at = np.column_stack([np.interp(inside, frames[:, 0], frames[:, axis]) for axis in (1, 2)])

    def rmse(shift: float) -> float:
        return float(
            np.sqrt(np.mean(np.sum((at - _position(track, log.trace.tick_rate, inside + shift)) ** 2, axis=1)))
        )

    shift = min(np.arange(-1.0, 1.05, 0.05).tolist(), key=rmse)
    return rmse(0.0), abs(shift), len(inside) / len(seen)


def run_scenarios(folder: Path) -> None:
    """Run the shipped scenarios."""
    command = [sys.executable, "-m", "simscen", "run", str(ROOT / "scenarios"), "--out", str(folder)]
    subprocess.run(command, check=False, cwd=ROOT, stdout=subprocess.DEVNULL)


def main() -> int:
    """Print the table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="?", type=Path, help="output folder of `simscen run scenarios`")
    parser.add_argument("-k", default="", help="only scenarios whose name contains this text")
    parser.add_argument("--keep", type=Path, help="folder for the reconstructed scenarios; default: a temporary one")
    parser.add_argument("--belief", action="store_true", help="use the poses that the robot estimated")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=ROOT) as temporary:
        runs = arguments.runs or Path(temporary) / "runs"
        if arguments.runs is None:
            run_scenarios(runs)
        keep = arguments.keep or Path(temporary)
        keep.mkdir(parents=True, exist_ok=True)
        rows = []
        for file in sorted(runs.glob("runs/**/run.mcap")):
            name = "_".join(file.relative_to(runs).parts[2:-1])
            if arguments.k in name and "multi_robot" not in name:
                rows.append(compare(file, keep / f"{name}.scenario.yaml", "none" if arguments.belief else None))
                print(_line(rows[-1]), flush=True)
    good = [sum(getattr(row, name) for row in rows) for name in ("poses_agree", "objects_agree", "faults_agree")]
    print(f"{len(rows)} scenarios: poses agree in {good[0]}, moving objects in {good[1]}, faults in {good[2]}")
    return 0 if min(good) >= 5 / 6 * len(rows) else 1


def _line(row: Row) -> str:
    if row.problem:
        return f"✗ {row.name:45} {row.problem}"
    signs = "".join("✓" if good else "✗" for good in (row.poses_agree, row.objects_agree, row.faults_agree))
    parts = [f"start {row.start:.2f} goals {row.goals:.2f}"]
    parts += [
        f"{name} {rmse:.2f} m {late:.2f} s {100 * part:.0f} %" for name, (rmse, late, part) in row.objects.items()
    ]
    parts += [f"missing {sensor}.{kind}" for sensor, kind in sorted(row.missing)]
    parts += [f"extra {sensor}.{kind}" for sensor, kind in sorted(row.extra)]
    parts += [f"{row.pedestrians} as pedestrians"] if row.pedestrians else []
    parts += [f"{row.spurious} spurious moving objects"] if row.spurious else []
    return f"{signs} {row.name:45} {', '.join(parts)}"


if __name__ == "__main__":
    sys.exit(main())
