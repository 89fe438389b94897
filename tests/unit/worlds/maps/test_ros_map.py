"""Tests of ROS maps: loading in each mode and image format, and saving."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.model.world import RosMapSpec
from simscen.worlds.maps.ros_map import cell_values, load_map, save_map

GOLD = Path(__file__).parents[5] / "shared" / "data" / "nav2_map_loader_gold"
needs_gold = pytest.mark.skipif(not GOLD.is_dir(), reason="the third-party maps are missing: see CONTRIBUTING.md")


def spec(**changes):
    values = {"resolution": 0.1, "origin": [0.0, 0.0, 0.0], "occupied_thresh": 0.65, "free_thresh": 0.196}
    return RosMapSpec.model_validate({"image": "m", **values, **changes})


def write_pgm(path, header, body=b""):
    path.write_bytes(header + body)
    return path


@needs_gold
@pytest.mark.parametrize("image", ["testmap.png", "testmap.bmp", "testmap.pgm"])
def test_nav2_test_map_loads_as_in_nav2(image):
    expected = np.loadtxt(GOLD / "expected_grid.txt", dtype=int)
    grid, notes = load_map(RosMapSpec.model_validate(yaml.safe_load((GOLD / "testmap.yaml").read_text())), GOLD / image)
    assert np.array_equal(grid.cells, expected)
    assert grid.resolution == 0.1
    assert grid.origin == Pose2(2.0, 3.0, 1.0)
    assert notes == ()


@needs_gold
def test_missing_image_is_one_error():
    invalid = RosMapSpec.model_validate(yaml.safe_load((GOLD / "invalid_image.yaml").read_text()))
    with pytest.raises(InvalidInput, match="no such file") as caught:
        load_map(invalid, GOLD / invalid.image)
    assert len(caught.value.problems) == 1


def test_thresholds_are_compared_in_single_precision_and_include_their_own_value():
    # 1 - 100/255 is 0.6078431372…: equal to the threshold in float32, but below the threshold in float64.
    table = cell_values(spec(occupied_thresh=0.60784316, free_thresh=0.2))
    assert table[100] == 100
    assert table[101] == -1
    assert cell_values(spec(free_thresh=1 - 204 / 255))[204] == 0


def test_trinary_mode_has_free_occupied_and_unknown_cells():
    table = cell_values(spec())
    assert [int(table[gray]) for gray in (0, 89, 90, 205, 206, 255)] == [100, 100, -1, -1, 0, 0]
    assert [int(v) for v in cell_values(spec(negate=1))[[0, 49, 50, 165, 166, 255]]] == [0, 0, -1, -1, 100, 100]


def test_scale_mode_interpolates_between_the_thresholds():
    table = cell_values(spec(mode="scale", occupied_thresh=0.9, free_thresh=0.1))
    occupancy = 1 - np.arange(256) / 255
    is_between = (occupancy > 0.1) & (occupancy < 0.9)
    assert np.abs(table[is_between] - (occupancy[is_between] - 0.1) / 0.8 * 100).max() <= 0.5001
    assert table[0] == 100
    assert table[255] == 0
    assert not (table == -1).any()


def test_raw_mode_reads_pixels_as_percentages():
    table = cell_values(spec(mode="raw"))
    assert np.array_equal(table[:101], np.arange(101))
    assert (table[101:] == -1).all()


def test_pixels_that_are_not_opaque_are_unknown_except_in_raw_mode(tmp_path):
    pixels = np.array([[[0, 0, 0, 255], [0, 0, 0, 254], [255, 255, 255, 0]]], dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    assert load_map(spec(), tmp_path / "a.png")[0].cells.tolist() == [[100, -1, -1]]
    assert load_map(spec(mode="scale"), tmp_path / "a.png")[0].cells.tolist() == [[100, -1, -1]]
    assert load_map(spec(mode="raw"), tmp_path / "a.png")[0].cells.tolist() == [[0, 0, -1]]


def test_colors_are_converted_by_luma(tmp_path):
    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255]]], np.uint8)).save(tmp_path / "c.png")
    raw = load_map(spec(mode="raw"), tmp_path / "c.png")[0].cells.tolist()
    assert raw == [[76, -1, 29]]  # 0.299, 0.587 and 0.114 of 255, rounded down


def test_all_formats_and_depths_of_the_same_map_agree(tmp_path):
    grays = np.random.default_rng(1).integers(0, 256, (7, 5)).astype(np.uint8)
    image = Image.fromarray(grays)
    for name in ("a.png", "a.bmp", "a.pgm"):
        image.save(tmp_path / name)
    image.convert("RGB").save(tmp_path / "rgb.png")
    Image.fromarray(grays.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    write_pgm(tmp_path / "deep.pgm", b"P5 5 7\n65535\n", (grays.astype(">u2") * 257).tobytes())
    text = "# a comment\n".join(" ".join(map(str, row)) + "\n" for row in grays)
    write_pgm(tmp_path / "text.pgm", b"P2\n# made by hand\n5 7 # size\n255\n", text.encode())
    expected = cell_values(spec())[grays][::-1]
    for path in sorted(tmp_path.iterdir()):
        assert np.array_equal(load_map(spec(), path)[0].cells, expected), path.name


def test_gray_205_that_counts_as_free_gives_a_warning(tmp_path):
    path = write_pgm(tmp_path / "m.pgm", b"P5 2 1 255\n", bytes([205, 0]))
    assert load_map(spec(free_thresh=0.196), path)[1] == ()
    (note,) = load_map(spec(free_thresh=0.25), path)[1]
    assert "1 pixels of gray 205" in note
    assert load_map(spec(free_thresh=0.25, mode="raw"), path)[1] == ()


@pytest.mark.parametrize("values", [(0, 100, -1), tuple(range(-1, 101))])
def test_a_saved_map_loads_as_exactly_the_same_map(tmp_path, values):
    cells = np.random.default_rng(2).choice(values, (11, 6)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, Pose2(-1.2345678901234567, 1e-5, -0.1))
    save_map(grid, tmp_path / "my: map.yaml")
    saved_spec = RosMapSpec.model_validate(yaml.safe_load((tmp_path / "my: map.yaml").read_text()))
    loaded, notes = load_map(saved_spec, tmp_path / saved_spec.image)
    assert np.array_equal(loaded.cells, cells)
    assert (loaded.resolution, loaded.origin, notes) == (grid.resolution, grid.origin, ())
