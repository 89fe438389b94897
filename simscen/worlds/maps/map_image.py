"""Read the images of ROS maps (PGM, PNG, and BMP) as nav2_map_server does."""

import io
import re
import stat
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from simscen.core.errors import InvalidInput, Problem
from simscen.core.files import record_read_file

if TYPE_CHECKING:
    from PIL import Image

Grays8 = npt.NDArray[np.uint8]
"""Gray values of pixels (rows, columns), 0 (black) to 255."""
Grays16 = npt.NDArray[np.uint16]
"""Gray values of pixels (rows, columns), 0 (black) to 65535."""

MAX_PIXELS, MAX_BYTES = 16 * 2**20, 64 * 2**20
"""Maximum number of pixels of an image, and maximum size of its file."""
PROBLEM_CODE = "SC320"

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
    """Return the content of a file. Raises UnreadableImage if it is not a regular file, too large, or unreadable."""
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
    if match[1] == b"P2":
        values = _ascii_samples(raster)
    else:
        sample = np.dtype(">u2" if maximum > 255 else "u1")
        values = np.frombuffer(raster, dtype=sample, count=min(width * height, len(raster) // sample.itemsize))
    if len(values) < width * height:
        raise UnreadableImage(f"the PGM is truncated: {len(values)} of {width * height} pixels")
    values = values[: width * height].reshape(height, width)
    if values.max() > maximum:
        raise UnreadableImage(f"a pixel is {values.max()}, above the maxval of {maximum}")
    scale = np.round(np.arange(maximum + 1) * (65535 / maximum)).astype(np.uint16)
    quanta: Grays16 = scale[values]
    return quanta


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
    """Return width and height of a BMP from its header. The height is negative in the file if rows begin at the top."""
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
