"""Tests of the scenarios of `simscen bench growth`, and of the sample and figures of `simscen bench suite`."""

import pytest

from simscen.bench.speed.growth import QUANTITIES, write_scaled_patrol
from simscen.bench.speed.run_overhead import SHORT_RUN_S, short_patrol
from simscen.bench.speed.session_speed import SuiteResult, evenly_spaced
from simscen.loading.builders import load_robot, load_world
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario


def count(quantity: str, loaded: LoadedScenario) -> int:
    """Return the amount of a quantity, such as the number of obstacles or lidar beams, in a scenario."""
    spec, world = loaded.spec, load_world(loaded)
    match quantity:
        case "obstacles":
            return sum(solid.name.startswith("crate") for solid in world.solids)
        case "objects":
            return sum(body.mass > 0 for body in world.bodies)
        case "moving objects":
            return sum(body.path is not None for body in world.bodies) - 1  # one of them is the cart of the patrol
        case "beams":
            return next(sensor.lidar.beams for sensor in load_robot(loaded)[0].sensors.values() if sensor.lidar)
        case "particles":
            return spec.stack.localizer.max_particles
        case _:
            return len(loaded.robots)


@pytest.mark.parametrize(
    ("quantity", "amount"), [(quantity, amount) for quantity, counts in QUANTITIES.items() for amount in counts[::2]]
)
def test_growth_scenario_has_the_stated_amount(tmp_path, quantity, amount):
    assert count(quantity, load_scenario(write_scaled_patrol(tmp_path, quantity, amount), tmp_path)) == amount


def test_short_patrol_has_the_stated_time_limit(tmp_path):
    assert load_scenario(short_patrol(tmp_path), tmp_path).spec.time_limit == SHORT_RUN_S


def test_sample_of_a_large_suite_is_evenly_spaced():
    assert evenly_spaced(list(range(89)), 60)[:4] == [0, 1, 2, 4]
    assert len(set(evenly_spaced(list(range(89)), 60))) == 60
    assert evenly_spaced([1, 2], 60) == [1, 2]


def test_suite_time_is_compared_with_pybullet_for_the_same_simulated_time():
    suite = SuiteResult(60, (), 2, simulated=1200.0, wall=20.0, cpu=36.0, memory=(100.0, 120.0, 300.0), baseline=0.0075)
    figures = {name: figure.value for name, figure in suite.figures.items()}
    assert figures["suite: runs a minute"] == 180.0
    assert figures["suite: wall time, times PyBullet alone on one core"] == pytest.approx(20 / 9)
    assert figures["suite: CPU time, times PyBullet alone"] == pytest.approx(4.0)
    assert (figures["suite: memory of a worker"], figures["suite: memory of the largest worker"]) == (120.0, 300.0)
