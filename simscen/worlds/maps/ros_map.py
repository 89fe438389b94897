"""Read and write ROS maps (YAML file and image) as Nav2's map_server does (nav2_map_server/src/map_io.cpp)."""

import io
import json
import re
import stat
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.errors import InvalidInput, Problem
from simscen.core.files import record_read_file, require_regular_file
from simscen.core.geometry import Pose2
from simscen.model.world import RosMapSpec

if TYPE_CHECKING:
    from PIL import Image

Grays8 = npt.NDArray[np.uint8]
"""Gray values of pixels (rows, columns), 0 (black) to 255."""
Grays16 = npt.NDArray[np.uint16]
"""Gray values of pixels (rows, columns), 0 (black) to 65535."""

MAX_PIXELS, MAX_BYTES = 16 * 2**20, 64 * 2**20
"""Maximum number of pixels of an image, and maximum size of the image file."""
PROBLEM_CODE = "SC320"
"""Error code of all problems with the image of a map."""
UNKNOWN_GRAY, FREE_GRAY, OCCUPIED_GRAY = 205, 254, 0
"""Gray values in trinary maps by Nav2's map_saver."""
MAX_DISTANCE_M = 1e4
"""Maximum distance of map cells from the origin of the map frame, as for coordinates in all files."""

# Header of a PGM: P2 or P5, width, height, and maxval, separated by white space or comments.
_PNM_SEPARATOR = rb"(?:\s|#[^\r\n]*[\r\n])+"
_PNM_HEADER = re.compile(
    rb"(P[25])" + _PNM_SEPARATOR + rb"(\d{1,10})" + _PNM_SEPARATOR + rb"(\d{1,10})" + _PNM_SEPARATOR + rb"(\d{1,10})\s"
)


@dataclass(frozen=True, eq=False)
class MapImage:
    """Pixels as nav2_map_server reads them with GraphicsMagick; the first row is the top of the image."""

    gray: Grays8
    alpha: Grays8 | None = None
    """Opacity of the pixels, 0 to 255; None if the image has no alpha channel."""


class UnreadableImage(Exception):
    """An image cannot be read; the message is the reason."""


def read_image(path: Path) -> MapImage:
    """Read a PGM (P2 or P5, 8 or 16 bit), PNG or BMP; raises InvalidInput for other, damaged, or too large files."""
    try:
        data = _read_bytes(path)
        if data[:2] in (b"P2", b"P5"):
            return MapImage(_to_8_bits(_decode_pgm(data)))
        return _decode_png_or_bmp(data)
    except UnreadableImage as error:
        raise InvalidInput([Problem(str(path), 0, 0, PROBLEM_CODE, str(error))]) from None


def _read_bytes(path: Path) -> bytes:
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise UnreadableImage("not a regular file")
        if status.st_size > MAX_BYTES:
            raise UnreadableImage(f"map too large: {status.st_size} bytes, more than {MAX_BYTES}")
        record_read_file(path.resolve())
        return path.read_bytes()
    except OSError as error:
        reason = (error.strerror or "cannot be read").lower()
        raise UnreadableImage(f"cannot read the map's image: {reason}") from None


def _check_size(width: int, height: int) -> None:
    """Raise UnreadableImage for an image without pixels or with more than MAX_PIXELS."""
    if width < 1 or height < 1:
        raise UnreadableImage(f"the image has no pixels: {width} x {height}")
    if width * height > MAX_PIXELS:
        raise UnreadableImage(f"map too large: {width} x {height} pixels, more than {MAX_PIXELS}")


def _decode_pgm(data: bytes) -> Grays16:
    """Return the pixels of a PGM, scaled to 16 bit. Source: netpbm's pgm(5); samples of two bytes are big-endian."""
    match = _PNM_HEADER.match(data)
    if match is None:
        raise UnreadableImage("the PGM header is damaged; expected width, height and maxval")
    width, height, maximum = (int(text) for text in match.groups()[1:])
    _check_size(width, height)
    if not 1 <= maximum <= 65535:
        raise UnreadableImage(f"maxval must be between 1 and 65535, not {maximum}")
    raster = data[match.end() :]
    values = _ascii_samples(raster) if match[1] == b"P2" else _binary_samples(raster, width * height, maximum)
    if len(values) < width * height:
        raise UnreadableImage(f"the PGM is truncated: {len(values)} of {width * height} pixels")
    values = values[: width * height].reshape(height, width)
    if values.max() > maximum:
        raise UnreadableImage(f"a pixel is {values.max()}, above the maxval of {maximum}")
    scale = np.round(np.arange(maximum + 1) * (65535 / maximum)).astype(np.uint16)
    quanta: Grays16 = scale[values]
    return quanta


def _binary_samples(raster: bytes, count: int, maximum: int) -> npt.NDArray[np.generic]:
    """Return the first `count` samples of a P5 raster, or fewer if it is truncated. `maximum` is the PGM's maxval."""
    sample = np.dtype(">u2" if maximum > 255 else "u1")
    return np.frombuffer(raster, dtype=sample, count=min(count, len(raster) // sample.itemsize))


def _ascii_samples(raster: bytes) -> npt.NDArray[np.generic]:
    """Return all samples of a P2 raster. Raises UnreadableImage if it contains something else than numbers."""
    text = re.sub(rb"#[^\r\n]*", b"", raster)
    if re.search(rb"[^\d\s]", text):
        raise UnreadableImage("the PGM contains something that is not a number")
    if len(text) > 0 and text.isspace():
        return np.empty(0, dtype=np.int64)
    return np.fromstring(text, dtype=np.int64, sep=" ")


def _decode_png_or_bmp(data: bytes) -> MapImage:
    from PIL import Image, UnidentifiedImageError

    if data[:8] == b"\x89PNG\r\n\x1a\n" and len(data) >= 24:
        kind, (width, height) = "PNG", struct.unpack(">II", data[16:24])
    elif data[:2] == b"BM" and len(data) >= 26:
        kind, (width, height) = "BMP", _bmp_size(data)
    else:
        raise UnreadableImage("not a PGM (P2, P5), PNG or BMP image")
    _check_size(width, height)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image = Image.open(io.BytesIO(data), formats=[kind])
            _check_size(*image.size)
            image.load()
    except UnidentifiedImageError:  # its message contains the address of an object
        raise UnreadableImage(f"the {kind} cannot be decoded") from None
    except (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError) as error:
        raise UnreadableImage(f"the {kind} cannot be decoded: {error}") from None
    return _gray_and_alpha(image)


def _bmp_size(data: bytes) -> tuple[int, int]:
    """Return the width and the height in the header of a BMP."""
    (header,) = struct.unpack("<I", data[14:18])
    width, height = struct.unpack("<HH" if header == 12 else "<ii", data[18 : 22 if header == 12 else 26])
    return width, abs(height)


def _gray_and_alpha(image: "Image.Image") -> MapImage:
    """Convert colors to gray as GraphicsMagick does: 0.299 R + 0.587 G + 0.114 B (Rec. 601), in integers."""
    if image.mode.startswith("I"):
        return MapImage(_to_8_bits(np.clip(np.asarray(image), 0, 65535).astype(np.uint16)))
    has_alpha = image.mode in ("LA", "PA", "RGBA") or "transparency" in image.info
    red, green, blue, *alpha = np.moveaxis(np.asarray(image.convert("RGBA" if has_alpha else "RGB")), 2, 0)
    quanta = [color.astype(np.uint32) * 257 for color in (red, green, blue)]
    luma = (306 * quanta[0] + 601 * quanta[1] + 117 * quanta[2]) >> 10
    return MapImage(_to_8_bits(luma.astype(np.uint16)), alpha[0] if has_alpha else None)


def _to_8_bits(quanta: Grays16) -> Grays8:
    return (quanta // 257).astype(np.uint8)


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
        between = (occupancy > free) & (occupancy < occupied)
        span = np.float32(spec.occupied_thresh - spec.free_thresh)
        scaled = (occupancy[between] - free) / span * np.float32(100)
        values[between] = np.floor(scaled + np.float32(0.5))  # round half away from zero, as C++ does
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
    if not is_trinary:
        return np.where(cells < 0, np.uint8(255), cells.astype(np.uint8))
    return np.select((cells == FREE, cells == OCCUPIED), (FREE_GRAY, OCCUPIED_GRAY), UNKNOWN_GRAY).astype(np.uint8)


def format_decimal(value: float) -> str:
    """Return the shortest decimal with the same value, without an exponent: YAML 1.1 reads `1e-05` as text."""
    return np.format_float_positional(value, unique=True, trim="0")
