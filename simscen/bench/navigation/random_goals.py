"""Experiments with drives between random free poses of a world, with and without sensor faults."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Pose2
from simscen.core.random_streams import Streams
from simscen.worlds.routes.shortest_paths import ShortestPaths

WALL_MARGIN_M = 0.12
"""Minimum distance between the robot's outline and walls on the shortest path."""
MOVABLE_MARGIN_M = 1.5
"""Minimum distance of start and goal to the origins of doors and movable objects."""
MAX_ATTEMPTS = 2000
"""Maximum number of random pairs of start and goal for one drive."""


@dataclass(frozen=True)
class RandomDrive:
    """Drive from `start` to `goal`. `length` is the length of the shortest path in m."""

    number: int
    start: Pose2
    goal: Pose2
    length: float


def random_drives(
    built: BuiltWorld, radius: float, numbers: Iterable[int], min_length: float = 5.0
) -> Iterator[RandomDrive]:
    """Yield a random drive of a disc-shaped robot for each number, with a path of at least `min_length` in m.

    A drive depends only on its number, the world, `radius` in m, and `min_length`. A number is skipped if no
    drive is found.
    """
    paths = ShortestPaths(built.mesh, built.world.bounds, radius + WALL_MARGIN_M)
    movable = [body.pose.plane for body in built.world.bodies]
    free = np.argwhere(built.map.cells == 0)
    for number in numbers if len(free) else ():
        rng = Streams(number).generator("errand")
        for _ in range(MAX_ATTEMPTS):
            ends = built.map.center_of(free[rng.integers(0, len(free), 2)]).tolist()
            start, goal = (Pose2(x, y, float(rng.uniform(-math.pi, math.pi))) for x, y in ends)
            is_near_movable = any(end.distance(pose) < MOVABLE_MARGIN_M for pose in movable for end in (start, goal))
            if start.distance(goal) < min_length / 2 or is_near_movable:
                continue
            length = paths.length(start, goal)
            if math.isfinite(length) and length >= min_length:
                yield RandomDrive(number, start, goal, length)
                break


ROBOT_RADIUS_M = 0.22
"""Radius of the default robot, a TurtleBot."""
MIN_AVERAGE_SPEED_M_S = 0.2
"""Average speed on the shortest path that a robot needs to arrive within the time limit."""
FAULTS = {
    "lidar noise": ("{sensor: lidar, noise: {std: …}}", ("3 cm", "6 cm", "12 cm")),
    "lidar garbage": ("{sensor: lidar, garbage: {probability: …}}", ("10 %", "50 %", "80 %")),
    "lidar delay": ("{sensor: lidar, delay: {jitter: …}}", ("100 ms", "200 ms", "400 ms")),
    "lidar sector": ("{sensor: lidar, sector: {from: 180 deg, to: …}}", ("210 deg", "270 deg", "350 deg")),
    "loose lidar": ("{sensor: lidar, intermittent: {up: 2 s, down: …}}", ("0.2 s", "0.5 s", "1 s")),
    "odometry scale": ("{sensor: odom, scale: {factor: …}}", ("103 %", "108 %", "120 %")),
    "odometry slip": ("{sensor: odom, slip: {left: …, right: 0 %}}", ("3 %", "10 %", "25 %")),
    "late commands": ("{sensor: cmd_vel, delay: {latency: …}}", ("50 ms", "120 ms", "250 ms")),
}
"""Faults by name: YAML, and the values by which … in the YAML is replaced, one for each of STRENGTHS."""
STRENGTHS = ("weak", "medium", "strong")
"""Names of the strengths of a fault."""
FIRST_FAULTY_DRIVE = 1_000_000
"""Smallest number of a drive with a fault. Drives without faults have smaller numbers."""


def scenario_text(name: str, world: str, drive: RandomDrive, faults: Sequence[str] = ()) -> str:
    """Return the YAML of a scenario. `world` is the value of `world:`, and `faults` are the items of `faults:`."""
    fault_lines = "".join(["faults:\n", *(f"  - {fault}\n" for fault in faults)]) if faults else ""
    limit = drive.length / MIN_AVERAGE_SPEED_M_S + 30.0
    return (
        f"simscen: 1\nname: {name}\nworld: {world}\nrobot: {{pose: {_pose_yaml(drive.start)}}}\n"
        f"goals:\n  - {{pose: {_pose_yaml(drive.goal)}}}\n{fault_lines}time_limit: {limit:.0f} s\n"
        "pass:\n  - goals_reached: {}\n  - collisions: {max: 0}\n"
    )


def write_random_goals(
    name: str, folder: Path, worlds: Mapping[str, BuiltWorld], numbers: Sequence[int], world_path: tuple[Path, ...] = ()
) -> Experiment:
    """Write an experiment with the random drives of these numbers in each world.

    Keys of `worlds` are values of `world:`. `world_path` are the folders for `--world-path`.
    """
    drives = []
    for world, built in worlds.items():
        for drive in random_drives(built, ROBOT_RADIUS_M, numbers):
            file = folder / f"{_file_stem(world)}_{drive.number}.scenario.yaml"
            drives.append(Drive(write_text(file, scenario_text(name, world, drive)), [drive.number], world=world))
    return Experiment(name, tuple(drives), folder, world_path)


def write_degraded_sensing(
    folder: Path, worlds: Mapping[str, BuiltWorld], seed: int, world_path: tuple[Path, ...] = ()
) -> list[Experiment]:
    """Write one experiment for each of STRENGTHS. It has one drive for each world and each of FAULTS.

    `worlds` and `world_path` are as in `write_random_goals`. `seed` is the seed of all runs, and selects the drives.
    """
    faults = dict(enumerate(FAULTS, start=FIRST_FAULTY_DRIVE + seed * len(FAULTS)))
    drives_by_world = {world: list(random_drives(built, ROBOT_RADIUS_M, faults)) for world, built in worlds.items()}
    experiments = []
    for level, strength in enumerate(STRENGTHS):
        drives = []
        for world, world_drives in drives_by_world.items():
            for drive in world_drives:
                fault = faults[drive.number]
                template, values = FAULTS[fault]
                text = scenario_text(f"{fault}, {strength}", world, drive, [template.replace("…", values[level])])
                file = folder / strength / f"{_file_stem(fault)}_{_file_stem(world)}.scenario.yaml"
                drives.append(Drive(write_text(file, text), [seed], world=world))
        experiments.append(Experiment(f"degraded sensing, {strength}", tuple(drives), folder, world_path))
    return experiments


def _pose_yaml(pose: Pose2) -> str:
    return f"{{x: {pose.x:.3f}, y: {pose.y:.3f}, yaw: {pose.yaw:.4f}}}"


def _file_stem(name: str) -> str:
    return Path(name).name.split(".")[0].replace(" ", "_")
