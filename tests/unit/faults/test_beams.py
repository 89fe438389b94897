"""Tests of lidar faults against geometry and distributions in closed form."""

import math

import numpy as np
import pytest
from fault_effects import image, scan, start, unsuitable_key

from simscen.faults.lidar_environment import MM_PER_HOUR
from simscen.model.sensors import Lidar


def visible_directions(sector: dict) -> list[int]:
    """Return the directions, from -180 to 179 degrees, in which a lidar with a blind sector measures ranges."""
    ranges = start({"sector": sector}, "Scan").reading(scan(np.full(360, 2.0))).ranges
    return [k - 180 for k in range(360) if ranges[k] == 2.0]


def test_blind_sector_extends_from_its_first_to_its_last_direction():
    assert visible_directions({"from": "-30 deg", "to": "45 deg"}) == [*range(-180, -30), *range(46, 180)]


def test_blind_sector_can_cross_180_degrees():
    assert visible_directions({"from": "170 deg", "to": "-170 deg"}) == list(range(-169, 170))
    assert visible_directions({"from": "0 deg", "to": "360 deg"}) == []


def test_sector_without_width_is_refused():
    assert unsuitable_key({"sector": {"from": 1, "to": 1}}, "Scan")[0] == "to"


def test_ranges_beyond_the_limit_become_infinite():
    measured = start({"range_limit": {"max": 3}}, "Scan").reading(scan([1.0, 3.0, 3.01, np.inf, np.nan])).ranges
    assert measured == pytest.approx([1.0, 3.0, np.inf, np.inf, np.nan], nan_ok=True)
    assert start({"range_limit": {"max": 3}}, "Image").reading(image([[2.0, 4.0]])).depth.tolist() == [[2.0, np.inf]]
    assert unsuitable_key({"range_limit": {"max": 12}}, "Scan", spec=Lidar())[0] == "max"


def test_ghost_fills_its_sector_behind_nearer_ranges():
    ranges = np.full(360, 2.0)
    ranges[180], ranges[181], ranges[182] = 0.5, np.inf, np.nan
    measured = start({"ghost": {"range": 1, "width": "10 deg"}}, "Scan").reading(scan(ranges)).ranges
    assert measured[180:183].tolist() == [0.5, 1.0, 1.0]
    assert np.flatnonzero(measured == 1.0).tolist() == [175, 176, 177, 178, 179, 181, 182, 183, 184, 185]
    assert unsuitable_key({"ghost": {"range": 20}}, "Scan", spec=Lidar())[0] == "range"


@pytest.mark.parametrize("width", [10, 20, 30, 40])
def test_ghost_includes_the_beams_at_both_edges_of_its_window(width):
    ghost = {"ghost": {"range": 1, "width": f"{width} deg"}}
    measured = start(ghost, "Scan").reading(scan(np.full(360, 2.0))).ranges
    assert np.flatnonzero(measured == 1.0).tolist() == list(range(180 - width // 2, 180 + width // 2 + 1))


def test_dust_shortens_beams_by_a_poisson_process():
    """With a wall at r, a share 1 - exp(-r / L) of the beams is short, with the mean L - r / (exp(r / L) - 1)."""
    path, wall = 8.0, 5.0
    measured = (
        start({"dust": {"mean_free_path": path}}, "Scan").reading(scan(np.full(40_000, wall), range_min=0.0)).ranges
    )
    short = measured < wall
    assert short.mean() == pytest.approx(1 - math.exp(-wall / path), abs=0.01)
    assert measured[short].mean() == pytest.approx(path - wall / (math.exp(wall / path) - 1), rel=0.02)
    assert (measured[~short] == wall).all()


def test_dust_is_hit_by_beams_without_target_within_the_range_of_the_lidar():
    measured = (
        start({"dust": {"mean_free_path": 1}}, "Scan")
        .reading(scan(np.full(20_000, np.inf), range_min=0.5, range_max=4))
        .ranges
    )
    finite = measured[np.isfinite(measured)]
    assert 0.5 <= finite.min() < finite.max() < 4
    assert np.isposinf(measured).mean() == pytest.approx(math.exp(-4), abs=0.005)
    assert np.isneginf(measured).mean() == pytest.approx(1 - math.exp(-0.5), abs=0.015)


def test_rain_hides_targets_beyond_the_detection_limit():
    """The largest measured range z solves ρ exp(-2 α z) / z² = 0.9 / 12² (here by bisection)."""
    alpha, low, high = 0.01 * 25**0.6, 0.1, 12.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if 0.5 * math.exp(-2 * alpha * middle) / middle**2 > 0.9 / 144 else (low, middle)
    ranges = np.linspace(0.5, 12, 5000)
    measured = start({"rain": {"rate": "25 mm/h", "reflectivity": 0.5}}, "Scan").reading(scan(ranges)).ranges
    assert ranges[np.isfinite(measured)].max() == pytest.approx(low, abs=0.005)
    assert np.isinf(measured[ranges > low + 0.005]).all()


def test_heavy_rain_adds_range_noise_of_two_percent():
    measured = start({"rain": {"rate": 10 * MM_PER_HOUR}}, "Scan").reading(scan(np.full(20_000, 4.0))).ranges
    assert measured.std() == pytest.approx(0.08, rel=0.03)
    assert measured.mean() == pytest.approx(4.0, abs=0.003)


def test_light_rain_does_not_hide_white_targets():
    measured = start({"rain": {"rate": 1e-6 * MM_PER_HOUR}}, "Scan").reading(scan(np.array([11.9, 0.2]))).ranges
    assert measured == pytest.approx([11.9, 0.2])
