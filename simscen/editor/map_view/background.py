"""Background of the editor's map: a ROS map as an image, or an SDF world as lines."""

import base64
from contextlib import suppress
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OccupancyGrid
from simscen.core.errors import InvalidInput
from simscen.loading.builders import load_map, world_from_file
from simscen.loading.loaded import LoadedWorld

SECTION_HEIGHT_M = 0.2
"""Height of the horizontal section through an SDF world that the map shows: the usual height of a lidar."""
MAX_IMAGE_SIDE_PX = 2048
"""Maximum width and height of the image of a map. Larger maps are scaled down."""
MAX_SEGMENTS = 40_000
"""Maximum number of lines of an SDF world."""
UNKNOWN_GRAY, FREE_GRAY, OCCUPIED_GRAY = 128, 255, 0


@dataclass
class Backgrounds:
    """Creates backgrounds, and caches the last one. `root` and `world_path` are the folders with worlds and maps."""

    root: Path
    world_path: tuple[Path, ...] = ()
    _cached_files: object = None
    _cached: dict[str, Any] = field(default_factory=dict)

    def background(self, source: LoadedWorld | None) -> dict[str, Any]:
        """Return the background of a world as JSON data.

        id:        ID that changes when a file of the map or SDF world changes; "" without such files
        bounds:    lowest x, lowest y, highest x, highest y in m; None without a background
        image:     image of the map
        segments:  lines (x, y, x, y) in m of the SDF world
        """
        if source is None:
            return {"id": "", "bounds": None}
        map_files = (source.map.path, source.map.image) if source.map else ()
        existing = [file for file in (source.sdf, *map_files) if file is not None and file.exists()]
        files = tuple((str(file), file.stat().st_mtime_ns) for file in existing)
        if not files:
            return {"id": "", "bounds": None}
        if self._cached_files != files:
            self._cached = {"id": str(hash(files)), "bounds": None}
            with suppress(InvalidInput):  # TextChecks reports the problem
                self._cached |= _image_part(load_map(source.map)) if source.map else self._segments_part(source)
            self._cached_files = files
        return self._cached

    def _segments_part(self, source: LoadedWorld) -> dict[str, Any]:
        """Return `bounds` and `segments` of an SDF world; {} for a world without solids."""
        from simscen.worlds.extent import placed_solids
        from simscen.worlds.geometry.cross_section import cross_section
        from simscen.worlds.geometry.triangulation import merge_solids

        world = world_from_file(replace(source, spec=None), self.root, self.world_path, lenient=True)
        solids = placed_solids(world.solids, world.bodies)
        if not solids:
            return {}
        segments = cross_section(merge_solids(solids), SECTION_HEIGHT_M).segments[:MAX_SEGMENTS]
        rounded = np.round(segments.reshape(-1, 4), 3).tolist()
        return {"bounds": list(world.bounds), "segments": rounded}


def _image_part(grid: OccupancyGrid) -> dict[str, Any]:
    """Return `bounds` and `image` of a map: a PNG as data URL, its size in m, and the pose of its origin."""
    from PIL import Image

    shades = np.array([UNKNOWN_GRAY, FREE_GRAY, OCCUPIED_GRAY], dtype=np.uint8)
    kind = np.where(grid.cells < 0, 0, np.where(grid.cells == FREE, 1, 2))
    image = Image.fromarray(shades[kind][::-1])
    image.thumbnail((MAX_IMAGE_SIDE_PX, MAX_IMAGE_SIDE_PX))
    data = BytesIO()
    image.save(data, "PNG")
    height, width = (cells * grid.resolution for cells in grid.shape)
    xs, ys = zip(*grid.corners, strict=True)
    return {
        "bounds": [min(xs), min(ys), max(xs), max(ys)],
        "image": {
            "url": "data:image/png;base64," + base64.b64encode(data.getvalue()).decode("ascii"),
            "origin": [grid.origin.x, grid.origin.y, grid.origin.yaw],
            "size": [width, height],
        },
    }
