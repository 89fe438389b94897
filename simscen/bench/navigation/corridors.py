"""Two robots that meet in a corridor, and ramps in a hall: generated, each like nothing that ships."""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from simscen.bench.navigation.experiments import Drive, Experiment, write_scenario
from simscen.core.random_streams import Streams

WIDTH = (1.4, 2.4)
"""Meters of a corridor: two robots of 0.44 m pass each other in the narrowest with 17 cm on each side."""
LENGTH = 14.0
SLOPE, HEIGHT = (2.0, 8.0), (0.03, 0.16)
"""Degrees and meters of ramps; what is as high as the lidar is a wall on the map, and no way leads over it."""
HALL = 2.4
"""Meters of the hall that they are in, from wall to wall."""


def two_robots(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Two robots set out at the ends of a corridor, each to where the other began; a corridor for each number."""
    return _numbered("two robots in a corridor", folder / "corridor", numbers, _meeting)


def ramps(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Up a ramp, over a platform and down again; slopes, heights and where the robot comes from are drawn."""
    return _numbered("ramps", folder / "ramp", numbers, _ramp)


def _numbered(name: str, stem: Path, numbers: Iterable[int], text: Callable[[int], str]) -> Experiment:
    """A scenario for each number, which is its seed as well."""
    drives = [
        Drive(write_scenario(stem.with_name(f"{stem.name}_{number}.scenario.yaml"), text(number)), [number])
        for number in numbers
    ]
    return Experiment(name, tuple(drives), stem.parent)


def _meeting(number: int) -> str:
    rng = Streams(number).generator("corridor")
    width = float(rng.uniform(*WIDTH))
    free = width / 2 - 0.35
    west, east = rng.uniform(-free, free, 2).tolist()
    return f"""\
simscen: 1
name: two robots meet in {width:.2f} m
world:
  simscen: 1
  walls:
    - {{name: corridor, points: [[0, 0], [{LENGTH:g}, 0], [{LENGTH:g}, {width:.3f}], [0, {width:.3f}], [0, 0]]}}
robots:
  eastbound:
    pose: {{x: 1.0, y: {width / 2 + west:.3f}}}
    goals: [{{name: east, pose: {{x: {LENGTH - 1:g}, y: {width / 2 + east:.3f}}}}}]
  westbound:
    pose: {{x: {LENGTH - 1:g}, y: {width / 2 + east:.3f}, yaw: 180 deg}}
    goals: [{{name: west, pose: {{x: 1.0, y: {width / 2 + west:.3f}, yaw: 180 deg}}}}]
time_limit: 120 s
pass:
  - goals_reached: {{}}
  - collisions: {{max: 0}}
"""


def _ramp(number: int) -> str:
    rng = Streams(number).generator("ramp")
    slope, height = float(rng.uniform(*SLOPE)), float(rng.uniform(*HEIGHT))
    run, flat = height / float(np.tan(np.radians(slope))), float(rng.uniform(1.5, 3.0))
    top, below = (3.0 + run, 3.0 + run + flat), 3.0 + 2 * run + flat
    end, y = below + 3.0, float(rng.uniform(0.6, HALL - 0.6))
    middle, size = HALL / 2, f"width: {HALL - 0.1:g}, height: {height:.4f}"
    return f"""\
simscen: 1
name: a ramp of {slope:.1f} degrees
world:
  simscen: 1
  walls: [{{name: hall, points: [[0, 0], [{end:.3f}, 0], [{end:.3f}, {HALL:g}], [0, {HALL:g}], [0, 0]]}}]
  ramps:
    - {{name: up, start: [3, {middle:g}], end: [{top[0]:.4f}, {middle:g}], {size}}}
    - {{name: down, start: [{below:.4f}, {middle:g}], end: [{top[1]:.4f}, {middle:g}], {size}}}
  obstacles:
    - name: platform
      box: [{flat:.4f}, {HALL - 0.1:g}, {height:.4f}]
      pose: {{x: {sum(top) / 2:.4f}, y: {middle:g}}}
robot: {{pose: {{x: 1.0, y: {y:.3f}}}}}
goals: [{{pose: {{x: {end - 1:.3f}, y: {middle:g}}}}}]
time_limit: 120 s
pass:
  - goals_reached: {{}}
  - collisions: {{max: 0}}
"""
