"""Generator of worlds for the navigation benchmark: office maps, corridors for two robots, and halls with ramps.

Office maps are ROS maps with cells of 5 to 25 cm, thin walls, and some unknown cells, like maps made by SLAM.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.random_streams import Streams

FINE_CELL_M = 0.05
"""Cell size of the image on which a floor is drawn, before the image is reduced to the resolution of the map."""
RESOLUTIONS_M = (0.05, 0.05, 0.10, 0.15, 0.20, 0.25)
"""Resolutions of maps. Consecutive floor numbers use the resolutions in turn."""
FLOOR_WIDTH_RANGE_M, FLOOR_DEPTH_RANGE_M = (20.0, 45.0), (12.0, 28.0)
CORRIDOR_WIDTH_RANGE_M, DOOR_WIDTH_RANGE_M = (1.7, 2.6), (0.9, 1.3)
FREE, WALL, UNKNOWN = 254, 0, 205
"""Pixel values of a ROS map image."""
Image = npt.NDArray[np.uint8]
"""Pixels (rows, columns); row 0 has the lowest y."""


@dataclass
class _Floor:
    """Image of a floor with cells of FINE_CELL_M. `wall_thickness` in m is the default for `draw_wall`."""

    image: Image
    wall_thickness: float

    def draw_wall(self, x0: float, y0: float, x1: float, y1: float, thickness: float | None = None) -> None:
        """Draw an axis-aligned wall between two points in m. If the points differ in x and y, draw a filled box."""
        half = (self.wall_thickness if thickness is None else thickness) / 2
        rows = slice(max(0, int((min(y0, y1) - half) / FINE_CELL_M)), int((max(y0, y1) + half) / FINE_CELL_M) + 1)
        columns = slice(max(0, int((min(x0, x1) - half) / FINE_CELL_M)), int((max(x0, x1) + half) / FINE_CELL_M) + 1)
        self.image[rows, columns] = WALL


def generate_office_map(number: int) -> tuple[Image, float]:
    """Return the map image of the office floor with this number (from 1), and the resolution in m per pixel."""
    rng = Streams(number).generator("building")
    resolution = RESOLUTIONS_M[number % len(RESOLUTIONS_M)]
    width, depth = float(rng.uniform(*FLOOR_WIDTH_RANGE_M)), float(rng.uniform(*FLOOR_DEPTH_RANGE_M))
    image = np.full((int(depth / FINE_CELL_M), int(width / FINE_CELL_M)), FREE, np.uint8)
    floor = _Floor(image, float(rng.choice([0.05, 0.1, 0.2])))
    for wall in ((0, 0, width, 0), (0, depth, width, depth), (0, 0, 0, depth), (width, 0, width, depth)):
        floor.draw_wall(*wall)
    corridor_width = float(rng.uniform(*CORRIDOR_WIDTH_RANGE_M))
    for y in np.arange(rng.uniform(4, 6), depth - 4, rng.uniform(9, 13)).tolist():
        for side in (-1, 1):
            _draw_rooms(floor, rng, y + side * corridor_width / 2, side)
    _draw_crossing_corridors(floor, rng, corridor_width)
    image[[0, -1]], image[:, [0, -1]] = WALL, WALL
    return _reduce_to_map(image, resolution, rng), resolution


def _draw_rooms(floor: _Floor, rng: np.random.Generator, y: float, side: int) -> None:
    """Draw rooms with doors and furniture along a corridor wall at `y`: above it for `side` 1, below it for -1."""
    depth, width = (size * FINE_CELL_M for size in floor.image.shape)
    x = 0.0
    while x < width:
        room, door = float(rng.uniform(3, 7)), float(rng.uniform(*DOOR_WIDTH_RANGE_M))
        door_start = float(rng.uniform(0.3, room - door - 0.3))
        floor.draw_wall(x, y, min(width, x + door_start), y)
        floor.draw_wall(min(width, x + door_start + door), y, min(width, x + room), y)
        far = min(max(y + side * float(rng.uniform(3.0, 3.8)), 0.0), depth)
        floor.draw_wall(min(width, x + room), y, min(width, x + room), far)
        for _ in range(int(rng.integers(0, 3))):
            left, low = x + float(rng.uniform(0.5, room - 0.5)), y + side * float(rng.uniform(1.2, 2.8))
            size = rng.uniform(0.2, 0.9, 2).tolist()
            floor.draw_wall(left, low, left + size[0], low + size[1], FINE_CELL_M)
        x += room


def _draw_crossing_corridors(floor: _Floor, rng: np.random.Generator, corridor_width: float) -> None:
    """Draw corridors along y through the rooms. Their walls have random gaps."""
    depth, width = (size * FINE_CELL_M for size in floor.image.shape)
    for x in np.arange(rng.uniform(5, 9), width - 3, rng.uniform(12, 20)).tolist():
        floor.image[
            int(0.5 / FINE_CELL_M) : -int(0.5 / FINE_CELL_M),
            int((x - corridor_width / 2) / FINE_CELL_M) : int((x + corridor_width / 2) / FINE_CELL_M),
        ] = FREE
        for side in (-1, 1):
            y = 0.5
            while y < depth - 1:
                length = float(rng.uniform(2, 6))
                if rng.random() < 0.6:
                    floor.draw_wall(
                        x + side * corridor_width / 2, y, x + side * corridor_width / 2, min(depth, y + length)
                    )
                y += length + float(rng.uniform(0.9, 1.6))


def _reduce_to_map(image: Image, resolution: float, rng: np.random.Generator) -> Image:
    """Return the image reduced to `resolution` in m. A few random free cells become unknown.

    A cell is a wall if more than 30 % of its pixels are wall (49 % in maps of up to 0.1 m). Walls of 5 cm can therefore
    vanish in maps of 0.2 m and more.
    """
    step = round(resolution / FINE_CELL_M)
    rows, columns = (size // step * step for size in image.shape)
    blocks = image[:rows, :columns].reshape(rows // step, step, columns // step, step)
    mapped = np.where((blocks == WALL).mean(axis=(1, 3)) > (0.3 if step > 2 else 0.49), WALL, FREE).astype(np.uint8)
    mapped[(mapped == FREE) & (rng.random(mapped.shape) < 0.001)] = UNKNOWN
    mapped[[0, -1]], mapped[:, [0, -1]] = WALL, WALL
    return mapped


def write_office_map(number: int, folder: Path) -> Path:
    """Write an office map in the format of map_server, and return its YAML file `building_<number>.yaml`."""
    mapped, resolution = generate_office_map(number)
    image = folder / f"building_{number}.pgm"
    folder.mkdir(parents=True, exist_ok=True)
    image.write_bytes(f"P5\n{mapped.shape[1]} {mapped.shape[0]}\n255\n".encode() + np.flipud(mapped).tobytes())
    text = f"image: {image.name}\nresolution: {resolution:g}\norigin: [0, 0, 0]\nnegate: 0\n"
    return write_text(image.with_suffix(".yaml"), f"{text}occupied_thresh: 0.65\nfree_thresh: 0.196\n")


MEETING_CORRIDOR_WIDTH_RANGE_M, MEETING_CORRIDOR_LENGTH_M = (1.4, 2.4), 14.0
"""Range of the width, and length, of a corridor in which two robots meet."""
RAMP_SLOPE_RANGE_DEG, RAMP_HEIGHT_RANGE_M = (2.0, 8.0), (0.03, 0.16)
"""Ranges of slope and height of ramps. The height stays below the lidar."""
HALL_WIDTH_M = 2.4
"""Width of the hall with the ramps."""


def write_two_robots(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Write a scenario for each number in which two robots meet in a corridor. The number is also the seed."""
    return _numbered_drives("two robots in a corridor", folder, "corridor", _meeting_scenario, numbers)


def write_ramps(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Write a scenario for each number in which a robot drives over a platform between two ramps.

    The number is also the seed.
    """
    return _numbered_drives("ramps", folder, "ramp", _ramp_scenario, numbers)


def _numbered_drives(
    name: str, folder: Path, stem: str, scenario_yaml: Callable[[int], str], numbers: Iterable[int]
) -> Experiment:
    """Write `scenario_yaml(number)` to the file `<stem>_<number>.scenario.yaml` for each number."""
    files = {number: folder / f"{stem}_{number}.scenario.yaml" for number in numbers}
    drives = (Drive(write_text(file, scenario_yaml(number)), [number]) for number, file in files.items())
    return Experiment(name, tuple(drives), folder)


def _meeting_scenario(number: int) -> str:
    rng, length = Streams(number).generator("corridor"), MEETING_CORRIDOR_LENGTH_M
    width = float(rng.uniform(*MEETING_CORRIDOR_WIDTH_RANGE_M))
    max_offset = width / 2 - 0.35
    west_offset, east_offset = rng.uniform(-max_offset, max_offset, 2).tolist()
    return f"""\
simscen: 1
name: two robots meet in {width:.2f} m
world:
  simscen: 1
  walls:
    - {{name: corridor, points: [[0, 0], [{length:g}, 0], [{length:g}, {width:.3f}], [0, {width:.3f}], [0, 0]]}}
robots:
  eastbound:
    pose: {{x: 1.0, y: {width / 2 + west_offset:.3f}}}
    goals: [{{name: east, pose: {{x: {length - 1:g}, y: {width / 2 + east_offset:.3f}}}}}]
  westbound:
    pose: {{x: {length - 1:g}, y: {width / 2 + east_offset:.3f}, yaw: 180 deg}}
    goals: [{{name: west, pose: {{x: 1.0, y: {width / 2 + west_offset:.3f}, yaw: 180 deg}}}}]
time_limit: 120 s
pass:
  - goals_reached: {{}}
  - collisions: {{max: 0}}
"""


def _ramp_scenario(number: int) -> str:
    rng = Streams(number).generator("ramp")
    slope, height = float(rng.uniform(*RAMP_SLOPE_RANGE_DEG)), float(rng.uniform(*RAMP_HEIGHT_RANGE_M))
    ramp_length, platform_length = height / float(np.tan(np.radians(slope))), float(rng.uniform(1.5, 3.0))
    platform_start = 3.0 + ramp_length
    platform_end = platform_start + platform_length
    down_end = platform_end + ramp_length
    hall_end, y = down_end + 3.0, float(rng.uniform(0.6, HALL_WIDTH_M - 0.6))
    hall = HALL_WIDTH_M
    middle, size = hall / 2, f"width: {hall - 0.1:g}, height: {height:.4f}"
    return f"""\
simscen: 1
name: a ramp of {slope:.1f} degrees
world:
  simscen: 1
  walls: [{{name: hall, points: [[0, 0], [{hall_end:.3f}, 0], [{hall_end:.3f}, {hall:g}], [0, {hall:g}], [0, 0]]}}]
  ramps:
    - {{name: up, start: [3, {middle:g}], end: [{platform_start:.4f}, {middle:g}], {size}}}
    - {{name: down, start: [{down_end:.4f}, {middle:g}], end: [{platform_end:.4f}, {middle:g}], {size}}}
  obstacles:
    - name: platform
      box: [{platform_length:.4f}, {hall - 0.1:g}, {height:.4f}]
      pose: {{x: {(platform_start + platform_end) / 2:.4f}, y: {middle:g}}}
robot: {{pose: {{x: 1.0, y: {y:.3f}}}}}
goals: [{{pose: {{x: {hall_end - 1:.3f}, y: {middle:g}}}}}]
time_limit: 120 s
pass:
  - goals_reached: {{}}
  - collisions: {{max: 0}}
"""
