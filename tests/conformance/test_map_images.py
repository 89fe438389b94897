"""Conformance tests of invalid and too large map images and map files."""

import os
import struct
import zlib
from pathlib import Path

import pytest

MAP = "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"


@pytest.fixture
def with_map(folder: Path, with_world):
    """Return `refused` for a scenario with a ROS map that has the given image as its world."""

    def call(image: bytes, name: str = "map.pgm", lines: str = "") -> str:
        (folder / name).write_bytes(image)
        return with_world(MAP.replace("map.pgm", name) + lines, "map.yaml")

    return call


def png(width: int, height: int, data: bytes) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


BOMB = png(13000, 13000, zlib.compress(bytes(13001) * 1000, 9))


@pytest.mark.parametrize(
    ("name", "image", "message"),
    [
        pytest.param("map.pgm", b"P5 100000 100000 255\n" + bytes(100), "map too large: 100000 x 100000", id="45"),
        pytest.param("map.pgm", b"P5 4 4 255\n" + bytes(15), "the PGM is truncated: 15 of 16", id="46 short"),
        pytest.param("map.pgm", b"P5 4 4 0\n" + bytes(16), "maxval must be between 1 and 65535", id="46 maxval"),
        pytest.param("map.pgm", b"P5 0 4 255\n", "the image has no pixels", id="46 no width"),
        pytest.param("map.pgm", b"P5 -4 4 255\n", "the PGM header is damaged", id="46 negative"),
        pytest.param("map.pgm", b"P5 4", "the PGM header is damaged", id="46 short header"),
        pytest.param("map.pgm", b"P2 4 4 255\n1 2 3\n", "the PGM is truncated: 3 of 16 pixels", id="46 P2 short"),
        pytest.param("map.pgm", b"P2 2 1 255\n1 256\n", "a pixel is 256, above the maxval", id="46 P2 above"),
        pytest.param("map.pgm", b"P2 2 1 255\n1 -1\n", "not a number", id="46 P2 below"),
        pytest.param("map.pgm", b"P2 1 1 255\n" + b"9" * 5000 + b"\n", "", id="46 P2 long number"),
        pytest.param("map.pgm", b"", "not a PGM (P2, P5), PNG or BMP image", id="46 empty"),
        pytest.param("map.png", BOMB, "map too large: 13000 x 13000 pixels", id="47"),
        pytest.param("map.png", png(4, 4, b"nonsense"), "the PNG cannot be decoded", id="47 damaged"),
        pytest.param("map.png", png(4, 4, b"")[:30], "the PNG cannot be decoded", id="47 truncated"),
        pytest.param("map.bmp", b"BM" + bytes(12) + struct.pack("<Iii", 40, 99999, 99999), "too large", id="47 BMP"),
    ],
)  # fmt: skip
def test_invalid_map_image_is_an_error(with_map, name: str, image: bytes, message: str) -> None:
    head = with_map(image, name).splitlines()[0]
    assert head.startswith(f"{name}: error[SC320]")
    assert message in head


@pytest.mark.parametrize(
    ("name", "image"), [("map.pgm", b"P5 100000 100000 255\n"), ("map.png", BOMB)], ids=["45 PGM", "47 PNG"]
)
def test_too_large_map_is_an_error_without_using_memory(peak_memory, folder: Path, name: str, image: bytes) -> None:
    (folder / name).write_bytes(image)
    (folder / "room.world.yaml").write_text(MAP.replace("map.pgm", name))
    code, peak, message = peak_memory("validate", "a.scenario.yaml")
    assert (code, "too large" in message) == (2, True)
    assert peak < 150


@pytest.mark.parametrize("kind", ["fifo", "folder", "device"])
def test_26_map_image_must_be_a_regular_file(with_world, folder: Path, kind: str) -> None:
    if kind == "fifo":
        os.mkfifo(folder / "map.pgm")
    elif kind == "folder":
        (folder / "map.pgm").mkdir()
    else:
        (folder / "map.pgm").symlink_to("/dev/zero")
    assert with_world(MAP, "map.yaml").startswith("map.yaml:1:8: error[SC0")


@pytest.mark.parametrize(
    ("lines", "place", "message"),
    [
        ("occupied_thresh: 0.2\nfree_thresh: 0.6\n", "5:14", "must be less than occupied_thresh"),
        ("occupied_thresh: 0.2\n", "1:1", "must be less than occupied_thresh"),
        ("mode: fancy\n", "4:7", "`fancy` is not one of the choices"),
        ("negate: 2\n", "4:9", ""),
    ],
)
def test_invalid_map_yaml_is_an_error(with_map, lines: str, place: str, message: str) -> None:
    head = with_map(b"P5 4 4 255\n" + bytes(16), lines=lines).splitlines()[0]
    assert head.startswith(f"map.yaml:{place}: error[SC0")
    assert message in head


def test_map_with_huge_resolution_is_an_error(with_world, folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"P5 40 40 255\n" + b"\xff" * 1600)
    message = with_world(MAP.replace("0.05", "1000"), "map.yaml")
    assert message.startswith("map.pgm: error[SC320] map too large: 40 x 40 pixels of 1000 m extend to 40000 m")


def test_world_with_a_too_large_map_is_an_error(with_world) -> None:
    message = with_world("simscen: 1\nwalls: [{points: [[-9000, -9000], [9000, 9000]]}]\n")
    assert message.startswith("bad.scenario.yaml:3:8: error[SC330] map too large: 360042 x 360042 cells")


def test_49_goal_outside_the_robots_map_is_an_error(with_scenario, folder: Path) -> None:
    (folder / "map.pgm").write_bytes(b"P5 40 40 255\n" + b"\xff" * 1600)
    (folder / "old.yaml").write_text(MAP)
    message = with_scenario(replace={"seed: 7": "map: old.yaml", "x: 1.5, y: 1": "x: 4, y: 3"})
    assert message.startswith(
        "bad.scenario.yaml:5:16: error[SC301] goal `goal-1` (4, 3) is outside the map (2 m x 2 m from"
    )
