"""Tests of map images that are invalid or too large."""

import os
import struct
import tracemalloc

import numpy as np
import pytest
from PIL import Image

from simscen.core.errors import InvalidInput
from simscen.worlds.maps.map_image import read_image


def assert_refused(path, reason):
    with pytest.raises(InvalidInput, match=reason) as caught:
        read_image(path)
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].path == str(path)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"P5 100000 100000 255\n", "map too large: 100000 x 100000 pixels"),
        (b"P5 10 10 255\n" + bytes(99), "truncated: 99 of 100 pixels"),
        (b"P5 10 10 65535\n" + bytes(199), "truncated: 99 of 100 pixels"),
        (b"P2 2 2 255\n1 2 3", "truncated: 3 of 4 pixels"),
        (b"P2 2 2 255\n", "truncated: 0 of 4 pixels"),
        (b"P2 2 2 255\n1 2 3 x", "not a number"),
        (b"P2 2 2 255\n1 2 3 300", "a pixel is 300, above the maxval of 255"),
        (b"P5 2 2 0\n1234", "maxval must be between 1 and 65535, not 0"),
        (b"P5 2 2 70000\n1234", "maxval must be between 1 and 65535, not 70000"),
        (b"P5 0 2 255\n", "no pixels"),
        (b"P5 -2 2 255\n1234", "header is damaged"),
        (b"P5 2", "header is damaged"),
        (b"", "not a PGM"),
        (b"GIF89a....", "not a PGM"),
        (b"\x89PNG\r\n\x1a\n" + bytes(8) + struct.pack(">II", 13000, 13000), "map too large: 13000 x 13000"),
        (b"\x89PNG\r\n\x1a\n" + bytes(8) + struct.pack(">II", 10, 10), "PNG cannot be decoded"),
        (b"BM" + bytes(12) + struct.pack("<Iii", 40, 13000, -13000), "map too large: 13000 x 13000"),
        (b"BM" + bytes(12) + struct.pack("<Iii", 40, 10, 10), "BMP cannot be decoded"),
    ],
)
def test_a_bad_image_is_refused_with_the_reason(tmp_path, data, reason):
    path = tmp_path / "m.img"
    path.write_bytes(data)
    assert_refused(path, reason)


def test_a_png_bomb_is_refused_before_it_is_decoded(tmp_path):
    Image.new("1", (13000, 13000)).save(tmp_path / "bomb.png")
    tracemalloc.start()
    assert_refused(tmp_path / "bomb.png", "map too large")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


def test_a_truncated_png_is_refused(tmp_path):
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (50, 50), np.uint8)).save(tmp_path / "m.png")
    data = (tmp_path / "m.png").read_bytes()
    (tmp_path / "m.png").write_bytes(data[: len(data) // 2])
    assert_refused(tmp_path / "m.png", "PNG cannot be decoded")


def test_nonregular_file_is_refused_without_opening_it(tmp_path):
    os.mkfifo(tmp_path / "pipe.pgm")
    assert_refused(tmp_path / "pipe.pgm", "not a regular file")
    assert_refused(tmp_path, "not a regular file")
