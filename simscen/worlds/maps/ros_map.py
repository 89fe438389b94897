"""Read and write ROS maps (YAML file and image) as Nav2's map_server does (nav2_map_server/src/map_io.cpp)."""

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.errors import InvalidInput, Problem
from simscen.core.files import require_regular_file
from simscen.core.geometry import Pose2
from simscen.model.world import RosMapSpec
from simscen.worlds.maps.map_image import PROBLEM_CODE, Grays8, read_image

UNKNOWN_GRAY, FREE_GRAY, OCCUPIED_GRAY = 205, 254, 0
"""Gray values in trinary maps by Nav2's map_saver."""
MAX_DISTANCE_M = 1e4
"""Maximum distance of map cells from the origin of the map frame, as for coordinates in all files."""


def load_map(spec: RosMapSpec, image_path: Path) -> tuple[OccupancyGrid, tuple[str, ...]]:
    """Return the map with the YAML content `spec` and the image at `image_path`, and warnings for the user.

    As in map_server, the occupancy depends on the 8-bit gray of a pixel. In the modes trinary and scale, pixels that
    are not opaque are unknown. Raises InvalidInput for an image that cannot be read, and for a map that extends farther
    than MAX_DISTANCE_M.
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
    """Raise InvalidInput for a map that extends farther than MAX_DISTANCE_M. `pixels` are width and height."""
    distance = max(pixels) * spec.resolution + max(abs(spec.origin[0]), abs(spec.origin[1]))
    if distance > MAX_DISTANCE_M:
        size = " x ".join(str(count) for count in pixels)
        message = f"map too large: {size} pixels of {spec.resolution:g} m extend to {distance:g} m"
        message += f", farther than {MAX_DISTANCE_M:g} m"
        raise InvalidInput([Problem(str(image_path), 0, 0, PROBLEM_CODE, message, "check the map's `resolution`")])


def cell_values(spec: RosMapSpec) -> npt.NDArray[np.int8]:
    """Return a table (256,) with the cell value, as in nav_msgs/OccupancyGrid, for each gray value."""
    grays = np.arange(256)
    if spec.mode == "raw":
        return np.where(grays <= OCCUPIED, grays, UNKNOWN).astype(np.int8)
    brightness = grays.astype(np.float32) / np.float32(255)
    occupancy = brightness if spec.negate else np.float32(1) - brightness
    free, occupied = np.float32(spec.free_thresh), np.float32(spec.occupied_thresh)
    values = np.where(occupancy >= occupied, OCCUPIED, UNKNOWN)
    values = np.where(occupancy <= free, FREE, values)
    if spec.mode == "scale":
        is_between = (occupancy > free) & (occupancy < occupied)
        span = np.float32(spec.occupied_thresh - spec.free_thresh)
        scaled = (occupancy[is_between] - free) / span * np.float32(100)
        values[is_between] = np.floor(scaled + np.float32(0.5))  # round half away from zero, as C++ does
    return values.astype(np.int8)


def _warnings(spec: RosMapSpec, table: npt.NDArray[np.int8], unknown_gray_count: int) -> tuple[str, ...]:
    """Return a warning if pixels with map_saver's gray for unknown cells are read as free."""
    if spec.mode == "raw" or spec.negate or not unknown_gray_count or table[UNKNOWN_GRAY] != FREE:
        return ()
    return (
        f"{spec.image}: {unknown_gray_count} pixels of gray 205, which map_saver writes for unknown, are read as free "
        f"because free_thresh is {spec.free_thresh:g}; 0.196 keeps them unknown",
    )


def save_map(grid: OccupancyGrid, yaml_path: Path) -> None:
    """Write a map to the file `yaml_path` and to a PGM file of the same name. Raises OSError.

    The mode is trinary, with map_saver's grays and thresholds, or raw if a cell is neither free, occupied, nor unknown.
    """
    image_path = yaml_path.with_suffix(".pgm")
    require_regular_file(image_path)
    is_trinary = bool(np.isin(grid.cells, (FREE, OCCUPIED, UNKNOWN)).all())
    height, width = grid.shape
    header = f"P5\n{width} {height}\n255\n".encode()
    image_path.write_bytes(header + _grays(grid.cells, is_trinary)[::-1].tobytes())
    origin = ", ".join(format_decimal(value) for value in grid.origin)
    lines = (
        f"image: {json.dumps(image_path.name)}",
        f"mode: {'trinary' if is_trinary else 'raw'}",
        f"resolution: {format_decimal(grid.resolution)}",
        f"origin: [{origin}]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    )
    yaml_path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _grays(cells: npt.NDArray[np.int8], is_trinary: bool) -> Grays8:
    """Return the gray values of cells; without `is_trinary`, the cell values themselves, and 255 for unknown cells."""
    if not is_trinary:
        return np.where(cells < 0, np.uint8(255), cells.astype(np.uint8))
    return np.select((cells == FREE, cells == OCCUPIED), (FREE_GRAY, OCCUPIED_GRAY), UNKNOWN_GRAY).astype(np.uint8)


def format_decimal(value: float) -> str:
    """Return the shortest decimal with the same value, without an exponent: YAML 1.1 reads `1e-05` as text."""
    return np.format_float_positional(value, unique=True, trim="0")
