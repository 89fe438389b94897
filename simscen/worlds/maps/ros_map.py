"""ROS maps, read and written as by Nav2's map_server (nav2_map_server/src/map_io.cpp)."""

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.errors import InvalidInput, Problem
from simscen.core.files import require_regular_file
from simscen.core.geometry import Pose2
from simscen.model.ros_map import RosMapSpec
from simscen.worlds.maps.map_image import CODE, read_image

UNKNOWN_GRAY, FREE_GRAY, OCCUPIED_GRAY = 205, 254, 0
"""Gray values of trinary maps written by map_saver."""

MAX_DISTANCE_M = 1e4
"""Maximum distance from the origin, as for coordinates in all files."""


def load_map(spec: RosMapSpec, image_path: Path) -> tuple[OccupancyGrid, tuple[str, ...]]:
    """Return the map of an image, and warnings. Raises InvalidInput for an image that cannot be read.

    As in map_server, only the 8-bit gray of a pixel counts, computed in single precision. In the modes trinary and
    scale, pixels that are not opaque are unknown.
    """
    image = read_image(image_path)
    _check_distance(spec, image.gray.shape[::-1], image_path)
    table = cell_values(spec)
    cells = table[image.gray]
    if image.alpha is not None and spec.mode != "raw":
        cells[image.alpha < 255] = UNKNOWN
    grid = OccupancyGrid(np.ascontiguousarray(cells[::-1]), spec.resolution, Pose2(*spec.origin))
    return grid, _warnings(spec, table, int(np.count_nonzero(image.gray == UNKNOWN_GRAY)))


def _check_distance(spec: RosMapSpec, pixels: tuple[int, ...], image_path: Path) -> None:
    """Raise InvalidInput for a too large map, e.g. with a resolution in the wrong unit."""
    distance = max(pixels) * spec.resolution + max(abs(spec.origin[0]), abs(spec.origin[1]))
    if distance > MAX_DISTANCE_M:
        size = " x ".join(str(count) for count in pixels)
        message = f"map too large: {size} pixels of {spec.resolution:g} m extend to {distance:g} m"
        message += f", farther than {MAX_DISTANCE_M:g} m"
        raise InvalidInput([Problem(str(image_path), 0, 0, CODE, message, "check the map's `resolution`")])


def cell_values(spec: RosMapSpec) -> npt.NDArray[np.int8]:
    """Return the cell value (256,) of nav_msgs/OccupancyGrid for each gray."""
    grays = np.arange(256)
    if spec.mode == "raw":
        return np.where(grays <= OCCUPIED, grays, UNKNOWN).astype(np.int8)
    share = grays.astype(np.float32) / np.float32(255)
    occupancy = share if spec.negate else np.float32(1) - share
    free, occupied = np.float32(spec.free_thresh), np.float32(spec.occupied_thresh)
    values = np.where(occupancy >= occupied, OCCUPIED, UNKNOWN)
    values = np.where(occupancy <= free, FREE, values)
    if spec.mode == "scale":
        between = (occupancy > free) & (occupancy < occupied)
        span = np.float32(spec.occupied_thresh - spec.free_thresh)
        scaled = (occupancy[between] - free) / span * np.float32(100)
        values[between] = np.floor(scaled + np.float32(0.5))  # round half away from zero, as C++ does
    return values.astype(np.int8)


def _warnings(spec: RosMapSpec, table: npt.NDArray[np.int8], unknown_grays: int) -> tuple[str, ...]:
    if spec.mode == "raw" or spec.negate or not unknown_grays or table[UNKNOWN_GRAY] != FREE:
        return ()
    return (
        f"{spec.image}: {unknown_grays} pixels of gray 205, which map_saver writes for unknown, are read as free "
        f"because free_thresh is {spec.free_thresh:g}; 0.196 keeps them unknown",
    )


def save_map(grid: OccupancyGrid, yaml_path: Path) -> None:
    """Write a map as `yaml_path` and a PGM file with the same name. Loading them gives the same grid. Raises OSError.

    The mode is trinary, with map_saver's grays and thresholds, or raw if there are other values than free, occupied and
    unknown.
    """
    image_path = yaml_path.with_suffix(".pgm")
    require_regular_file(image_path)
    trinary = bool(np.isin(grid.cells, (FREE, OCCUPIED, UNKNOWN)).all())
    height, width = grid.shape
    header = f"P5\n{width} {height}\n255\n".encode()
    image_path.write_bytes(header + _grays(grid.cells, trinary)[::-1].tobytes())
    origin = ", ".join(format_decimal(value) for value in grid.origin)
    lines = (
        f"image: {json.dumps(image_path.name)}",
        f"mode: {'trinary' if trinary else 'raw'}",
        f"resolution: {format_decimal(grid.resolution)}",
        f"origin: [{origin}]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    )
    yaml_path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _grays(cells: npt.NDArray[np.int8], trinary: bool) -> npt.NDArray[np.uint8]:
    if not trinary:
        return np.where(cells < 0, np.uint8(255), cells.astype(np.uint8))
    return np.select((cells == FREE, cells == OCCUPIED), (FREE_GRAY, OCCUPIED_GRAY), UNKNOWN_GRAY).astype(np.uint8)


def format_decimal(value: float) -> str:
    """Return the shortest decimal with the same value, without an exponent, which YAML 1.1 reads as text."""
    return np.format_float_positional(value, unique=True, trim="0")
