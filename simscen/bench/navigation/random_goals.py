"""Where a robot may start and where it may be sent: poses drawn from the free space of a world."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.bench.navigation.experiments import Drive, Experiment, write_scenario
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Pose2
from simscen.core.random_streams import Streams
from simscen.worlds.routes.shortest_paths import ShortestPaths

ROOM = 0.12
"""Meters between a robot's hull, as a disc, and the nearest wall, where it starts and where it is sent."""
MOVABLE = 1.5
"""Meters from a door or a thing that may move within which no drive begins or ends."""
TRIES = 2000


@dataclass(frozen=True)
class RandomDrive:
    """A number, from where to where, and the length in meters of the shortest way of the robot between them."""

    number: int
    start: Pose2
    goal: Pose2
    length: float


def random_drives(
    built: BuiltWorld, radius: float, numbers: Iterable[int], least: float = 5.0
) -> Iterator[RandomDrive]:
    """A drive of a disc of `radius` meters for each number, none shorter than `least` meters; always the same for a
    number; none for a number of which TRIES draws find none.
    """
    ways = ShortestPaths(built.mesh, built.world.bounds, radius + ROOM)
    free = np.argwhere(built.map.cells == 0)
    for number in numbers if len(free) else ():
        rng = Streams(number).generator("errand")
        for _ in range(TRIES):
            ends = built.map.center_of(free[rng.integers(0, len(free), 2)]).tolist()
            start, goal = (Pose2(x, y, float(rng.uniform(-math.pi, math.pi))) for x, y in ends)
            if start.distance(goal) < least / 2 or any(_near(end, built) for end in (start, goal)):
                continue
            length = ways.length(start, goal)
            if math.isfinite(length) and length >= least:
                yield RandomDrive(number, start, goal, length)
                break


def _near(pose: Pose2, built: BuiltWorld) -> bool:
    """Whether something that may move, of which the map knows nothing, is or may come there."""
    return any(math.hypot(pose.x - body.pose.x, pose.y - body.pose.y) < MOVABLE for body in built.world.bodies)


RADIUS = 0.22
"""Meters: the disc of the default robot, a TurtleBot."""
SLOWEST = 0.2
"""m/s: whoever is slower than this on average has not arrived in time."""
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
"""What a sensor or an actuator has during the whole drive: weak, medium and strong."""
STRENGTHS = ("weak", "medium", "strong")
OTHER_DRIVES = 1_000_000
"""Where the numbers of drives with a fault begin, so that they are not those without."""


def scenario(name: str, world: str, errand: RandomDrive, faults: Sequence[str] = ()) -> str:
    """The text of a scenario: one drive of the default robot, without a contact that it causes."""
    disturbed = "".join(["faults:\n", *(f"  - {fault}\n" for fault in faults)]) if faults else ""
    limit = errand.length / SLOWEST + 30.0
    return (
        f"simscen: 1\nname: {name}\nworld: {world}\nrobot: {{pose: {_pose(errand.start)}}}\n"
        f"goals:\n  - {{pose: {_pose(errand.goal)}}}\n{disturbed}time_limit: {limit:.0f} s\n"
        "pass:\n  - goals_reached: {}\n  - collisions: {max: 0}\n"
    )


def random_goals(
    name: str, folder: Path, worlds: Mapping[str, BuiltWorld], numbers: Sequence[int], world_path: tuple[Path, ...] = ()
) -> Experiment:
    """The drives of these numbers in each of the worlds, which are named as a scenario in `folder` names them."""
    drives = []
    for world, built in worlds.items():
        for errand in random_drives(built, RADIUS, numbers):
            file = folder / f"{_stem(world)}_{errand.number}.scenario.yaml"
            drives.append(Drive(write_scenario(file, scenario(name, world, errand)), [errand.number], world=world))
    return Experiment(name, tuple(drives), folder, world_path)


def degraded(
    folder: Path, worlds: Mapping[str, BuiltWorld], first: int, world_path: tuple[Path, ...] = ()
) -> list[Experiment]:
    """A drive in each world with each fault, its own; an experiment for each of three strengths, with the same drives.

    `first` is the number of the first drives, and the seed.
    """
    faults = dict(enumerate(FAULTS, start=OTHER_DRIVES + first * len(FAULTS)))
    errands_in = {world: list(random_drives(built, RADIUS, faults)) for world, built in worlds.items()}
    experiments = []
    for level, strength in enumerate(STRENGTHS):
        drives = []
        for world, found in errands_in.items():
            for errand in found:
                fault = faults[errand.number]
                said, values = FAULTS[fault]
                text = scenario(f"{fault}, {strength}", world, errand, [said.replace("…", values[level])])
                file = folder / strength / f"{_stem(fault)}_{_stem(world)}.scenario.yaml"
                drives.append(Drive(write_scenario(file, text), [first], world=world))
        experiments.append(Experiment(f"degraded sensing, {strength}", tuple(drives), folder, world_path))
    return experiments


def _pose(pose: Pose2) -> str:
    return f"{{x: {pose.x:.3f}, y: {pose.y:.3f}, yaw: {pose.yaw:.4f}}}"


def _stem(text: str) -> str:
    return Path(text).name.split(".")[0].replace(" ", "_")
