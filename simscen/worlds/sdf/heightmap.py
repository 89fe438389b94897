"""Terrain from an image, as Gazebo reads it: the brightest pixel is `size` z high, black is 0."""

import io
import warnings

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Mesh, Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.files import MESH_BYTES, Library
from simscen.worlds.sdf.markup import Element

LARGEST = 513
"""Pixels along an edge: Gazebo's terrains have 2^n + 1, so that 512 cells have 513 corners."""
FORMATS = ("PNG", "BMP", "PPM", "JPEG", "TIFF")
GRAY_MODES = ("L", "I", "I;16", "I;16B", "F")
"""Pillow's modes of one channel whose values are heights as they are."""


def read_heightmap(element: Element, library: Library) -> Solid:
    """The terrain as a mesh centered on `pos`; raises Unusable. Source: gz-common, ImageHeightmap.cc."""
    uri = element.child("uri")
    if uri is None:
        raise element.unusable("<uri> is missing")
    x, y, z = values.sizes(element, "size", 3, default=(1.0, 1.0, 1.0))
    pos = element.child("pos")
    origin = values.numbers(pos, 3) if pos else (0.0, 0.0, 0.0)
    return Solid(terrain(_heights(uri, library) * z, x, y), Pose3(*origin))


def _heights(uri: Element, library: Library) -> Array:
    """Heights (rows, columns) in 0 … 1, first row on top of the image."""
    from PIL import Image

    path = library.locate(uri)
    data = library.read(path, uri, MESH_BYTES)
    try:
        # A bomb is recognized by its header below, Pillow's own warning would only say the same again.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(data), formats=FORMATS)
        with image:
            if max(image.size) > LARGEST or min(image.size) < 2:
                raise uri.unusable(f"{library.shown(path)}: {image.size[0]} x {image.size[1]} pixels;"
                                   f" 2 to {LARGEST} an edge are read")  # fmt: skip
            gray = image if image.mode in GRAY_MODES else image.convert("L")
            pixels = np.asarray(gray, dtype=np.float64)
    except Image.DecompressionBombError as error:
        raise uri.unusable(f"{library.shown(path)}: image too large") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise uri.unusable(f"{library.shown(path)}: not a readable image (PNG, BMP, PGM, JPEG or TIFF)") from error
    if not np.isfinite(pixels).all() or pixels.min() < 0:
        raise uri.unusable(f"{library.shown(path)}: a height is negative or not a number", "save it as 16-bit gray")
    brightest = float(pixels.max())
    return pixels / brightest if brightest > 0 else pixels


def terrain(heights: Array, width: float, depth: float) -> Mesh:
    """Two triangles for each cell between samples `heights` (rows, columns), first row at +y, centered on x and y."""
    rows, columns = heights.shape
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, columns), np.linspace(depth / 2, -depth / 2, rows))
    vertices = np.column_stack([x.ravel(), y.ravel(), heights.ravel()])
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    nw, ne, sw, se = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack([nw, sw, se], axis=-1), np.stack([nw, se, ne], axis=-1)], axis=2)
    return Mesh(vertices, faces.reshape(-1, 3))
