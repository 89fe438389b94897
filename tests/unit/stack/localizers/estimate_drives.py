"""Drives through shipped and generated worlds for the evaluation of localizers without a simulation."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.loading.builders import world_from_file
from simscen.loading.files.single_files import load_world_file
from simscen.model.localizers import Amcl
from simscen.model.world import WorldSpec
from simscen.stack.protocols import Localizer, Surroundings
from simscen.stack.setting import Setting
from simscen.stack.validation.components import CheckedLocalizer
from simscen.testing.synthetic_room import ROBOT, TICK_RATE_HZ
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting.ray_scene import RayScene
from simscen.worlds.routes.shortest_paths import ShortestPaths
from simscen.worlds.world_file import world_from_spec

PERIOD_TICKS, BEAMS, LIDAR_HEIGHT_M = 24, 60, 0.2
KIDNAPPED_ROW = 200
"""Row (tenth of a second) at which the robot is kidnapped."""
ANGLES = -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
WORLDS = Path(__file__).parents[4] / "worlds"


@dataclass(frozen=True, eq=False)
class Recording:
    """Drive at 10 Hz: true poses (k, 3), motions (k, 3) reported by the wheels, and lidar ranges (k, 60) in m."""

    truth: Array
    steps: Array
    ranges: Array


@cache
def building(name: str) -> BuiltWorld:
    """Return a shipped world, or one of GENERATED; names that end with " coarse" have a map with cells of 20 cm."""
    base, _, coarse = name.partition(" ")
    if (WORLDS / f"{base}.world.yaml").exists():
        world = world_from_file(load_world_file(WORLDS / f"{base}.world.yaml", WORLDS), WORLDS)
    else:
        world = world_from_spec(WorldSpec.model_validate({"simscen": 1, **GENERATED[base]()}), base)
    return build_world_and_map(world, LIDAR_HEIGHT_M, 0.2 if coarse else 0.05)


def _hall(width: float, depth: float, boxes: list[tuple[float, float, float, float]]) -> dict[str, object]:
    """Return the keys of a world file: walls around a hall, and boxes given by center x, y and length, width in m."""
    outline = [[0, 0], [width, 0], [width, depth], [0, depth], [0, 0]]
    obstacles = [
        {"name": f"box {k}", "box": [a, b, 1.0], "pose": {"x": x, "y": y}} for k, (x, y, a, b) in enumerate(boxes)
    ]
    return {"walls": [{"name": "outline", "points": outline, "thickness": 0.2}], "obstacles": obstacles}


def _symmetric() -> dict[str, object]:
    """Return a hall that looks the same after a rotation by 180°, except for one box."""
    pairs = [(3.0, 2.0, 1.0, 0.6), (6.5, 1.5, 0.6, 1.2), (9.0, 5.5, 1.2, 0.4)]
    boxes = pairs + [(12 - x, 8 - y, a, b) for x, y, a, b in pairs]
    return _hall(12, 8, [*boxes, (6.0, 4.0, 0.5, 0.5), (11.3, 7.2, 0.5, 0.5)])


def _corridor() -> dict[str, object]:
    """Return a corridor of 30 m with a few boxes; a lidar with a range of 3.5 m mostly sees only two walls."""
    niches = [(4.0, 0.3), (11.0, 2.7), (13.5, 0.3), (21.0, 2.7), (27.0, 0.3)]
    return _hall(30, 3, [(x, y, 0.8, 0.4) for x, y in niches])


def _pillars() -> dict[str, object]:
    """Return a hall of 18 x 14 m with rows of equal pillars; one row is shifted."""
    boxes = [(x, y + (0.7 if x == 9 else 0), 0.4, 0.4) for x in range(3, 17, 3) for y in range(2, 13, 3)]
    return _hall(18, 14, boxes)


def _clutter() -> dict[str, object]:
    """Return a hall of 16 x 10 m with 25 random boxes."""
    rng = np.random.default_rng(5)
    boxes = rng.uniform((1, 1, 0.3, 0.3), (15, 9, 1.2, 1.2), (25, 4)).tolist()
    return _hall(16, 10, [(x, y, a, b) for x, y, a, b in boxes])


GENERATED = {"symmetric": _symmetric, "corridor": _corridor, "pillars": _pillars, "clutter": _clutter}
BUILDINGS = ("house", "office", "warehouse", *GENERATED, "house coarse")


@cache
def shortest_paths(name: str) -> ShortestPaths:
    """Return shortest paths with a clearance of 0.4 m."""
    return ShortestPaths(building(name).mesh, building(name).world.bounds, 0.4)


@cache
def drive(name: str, seed: int, seconds: float = 60.0) -> Array:
    """Return true poses (k, 3) at 10 Hz of a drive between random points, with at most 0.5 m/s and 1 rad/s."""
    corners = _corners(name, np.random.default_rng((seed, 1)))
    start, goal = next(corners), next(corners)
    pose, truth = Pose2(*start, float(np.arctan2(*(goal - start)[::-1]))), []
    while len(truth) < seconds * 10:
        truth.append(pose)
        if np.hypot(*(goal - pose[:2])) < 0.1:
            goal = next(corners)
        x, y, _ = pose.between(Pose2(*goal))
        error = np.arctan2(y, x)
        turn = float(np.clip(2 * error, -1, 1)) * 0.1
        ahead = min(0.05, float(np.hypot(x, y))) * max(0.0, float(np.cos(error))) ** 16
        pose = pose.compose(Pose2(ahead * np.cos(turn / 2), ahead * np.sin(turn / 2), turn))
    return np.array(truth)


def _corners(name: str, rng: np.random.Generator) -> Iterator[Array]:
    """Yield an endless sequence of corners (2,) of shortest paths between random points."""
    left, low, right, high = building(name).world.bounds
    position: Array | None = None
    while True:
        ends = rng.uniform((left, low), (right, high), (2, 2))
        path = shortest_paths(name).path(Pose2(*(ends[0] if position is None else position)), Pose2(*ends[1]))
        if path is not None:
            yield from path if position is None else path[1:]
            position = path[-1]


def record(truth: Array, scene: RayScene) -> Recording:
    """Return the recording of wheels and a lidar without errors at these true poses."""
    poses = [Pose2(*row) for row in truth]
    steps = np.array([Pose2(0, 0, 0), *(a.between(b) for a, b in pairwise(poses))])
    heading = (truth[:, 2:] + ANGLES).ravel()
    origins = np.repeat(np.column_stack((truth[:, :2], np.full(len(truth), LIDAR_HEIGHT_M))), BEAMS, axis=0)
    directions = np.column_stack((np.cos(heading), np.sin(heading), np.zeros_like(heading)))
    return Recording(truth, steps, scene.cast(origins, directions).reshape(len(truth), BEAMS))


def moved_furniture(name: str, truth: Array, seed: int) -> RayScene:
    """Return the scene of a world with random unmapped boxes beside the robot's path."""
    built, rng = building(name), np.random.default_rng((seed, 2))
    low, high = built.world.bounds[:2], built.world.bounds[2:]
    boxes: list[tuple[float, float, float, float]] = []
    area = (high[0] - low[0]) * (high[1] - low[1])
    while len(boxes) < area / 8:
        x, y = rng.uniform(low, high)
        a, b = rng.uniform(0.3, 1.0, 2)
        if np.hypot(*(truth[:, :2] - (x, y)).T).min() > 0.3 + np.hypot(a, b) / 2:
            boxes.append((float(x), float(y), float(a), float(b)))
    spec = WorldSpec.model_validate({"simscen": 1, "obstacles": _hall(1, 1, boxes)["obstacles"]})
    return RayScene(merge_solids((*built.world.solids, *world_from_spec(spec, "more").solids)))


def with_people_and_slip(recording: Recording, seed: int, people: int = 6) -> Recording:
    """Return the same drive with people that come and go, and with wheels that slip by up to 30 % at times."""
    rng, ranges = np.random.default_rng((seed, 3)), recording.ranges.copy()
    bearing, distance = rng.uniform(-np.pi, np.pi, people), rng.uniform(0.6, 2.5, people)
    phase, period = rng.uniform(0, 2 * np.pi, people), rng.uniform(8, 30, people)
    for row, yaw in enumerate(recording.truth[:, 2]):
        bearing += rng.normal(0, 0.05, people)
        distance = np.clip(distance + rng.normal(0, 0.05, people), 0.5, 3)
        is_near = np.sin(2 * np.pi * row / 10 / period + phase) > 0
        for direction, range_m in zip(bearing[is_near], distance[is_near], strict=True):
            angle = np.abs((ANGLES - direction + yaw + np.pi) % (2 * np.pi) - np.pi)
            np.minimum(ranges[row], range_m, out=ranges[row], where=angle < np.arctan(0.3 / range_m))
    slip, row = np.ones((len(recording.steps), 3)), 0
    while row < len(slip):
        end = row + int(rng.integers(5, 20))
        slip[row:end, 0] += rng.choice([0, 0, 0.1, -0.1, 0.3])
        row = end
    slip[:, 2] += (slip[:, 0] - 1) / 6
    return Recording(recording.truth, recording.steps * slip, ranges)


CIRCUMSTANCES = {
    "known": "correct initial estimate with the default uncertainty",
    "crowded": "as known, with people, unmapped furniture, and wheels that slip by up to 30 %",
    "short": "as known, with a lidar range of 3.5 m instead of 12 m",
    "short, crowded": "as crowded, with a lidar range of 3.5 m",
    "wide": "initial estimate with standard deviations of 1 m and 46°, which the localizer knows",
    "unknown": "no initial estimate, 5000 particles",
    "kidnapped": "moved to another place after 20 s, 5000 particles, recovery (0.001, 0.1)",
}
"""Names of the conditions of a drive, with their descriptions."""


@dataclass(frozen=True, eq=False)
class Case:
    """A recorded drive, with initial estimate, specification and map of the localizer, and lidar range in m."""

    recording: Recording
    estimate: Estimate
    spec: Amcl
    map: OccupancyGrid
    range_max: float
    seed: int

    def readings(self) -> Iterator[tuple[Odometry, Scan]]:
        """Yield odometry and scan of each tenth of a second, with the default noise of simscen's sensors."""
        rng, odometry = np.random.default_rng((self.seed, 4)), Pose2(0.0, 0.0, 0.0)
        ranges = self.recording.ranges + rng.normal(0, 0.01, self.recording.ranges.shape)
        ranges = np.where(ranges < self.range_max, ranges, np.inf)
        for row, step in enumerate(self.recording.steps):
            distance = float(np.hypot(step[0], step[1]))
            scale = 1 + rng.normal() * 0.01 * np.sqrt(distance) / max(distance, 1e-9)
            turn = step[2] + rng.normal() * np.sqrt(1e-4 * abs(step[2]) + 2.5e-5 * distance)
            odometry = odometry.compose(Pose2(step[0] * scale, step[1] * scale, turn))
            tick = row * PERIOD_TICKS
            yield (
                Odometry("odom", tick, odometry, Twist()),
                Scan("lidar", tick, ranges[row], -np.pi, 2 * np.pi / BEAMS, 0.05, self.range_max),
            )

    def localizer(self) -> Localizer:
        """Return a localizer with the initial estimate."""
        surroundings = Surroundings(ROBOT, self.map, TICK_RATE_HZ)
        setting = Setting(surroundings, "localizer", Streams(self.seed), estimate=self.estimate)
        return CheckedLocalizer(self.spec, setting)


def case(name: str, circumstance: str, model: str, seed: int) -> Case:
    """Return a drive through a building under one of CIRCUMSTANCES, with a sensor model for the localizer."""
    built, truth = building(name), drive(name, seed)
    changes: dict[str, object] = {"laser_model_type": model}
    scene, estimate = RayScene(built.mesh), Estimate(Pose2(*truth[0]))
    match circumstance:
        case "kidnapped":
            changes |= {"max_particles": 5000, "recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}
            truth = np.concatenate((truth[:KIDNAPPED_ROW], drive(name, seed + 100)))
        case "wide":
            std = (1.0, 1.0, 0.8)
            estimate = Estimate(Pose2(*np.random.default_rng((seed, 5)).normal(truth[0], std)), std)
        case "unknown":
            estimate, changes = Estimate(None), changes | {"max_particles": 5000}
        case "crowded" | "short, crowded":
            scene = moved_furniture(name, truth, seed)
    recording = record(truth, scene)
    if circumstance == "kidnapped":
        recording.steps[KIDNAPPED_ROW] = 0
    if "crowded" in circumstance:
        recording = with_people_and_slip(recording, seed)
    range_max = 3.5 if "short" in circumstance else 12.0
    return Case(recording, estimate, Amcl.model_validate(changes), built.map.refined(0.05), range_max, seed)
