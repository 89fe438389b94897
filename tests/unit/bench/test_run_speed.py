"""Test that `simscen bench` measures all parts of a run."""

from simscen.bench.speed.measurement import Stopwatch
from simscen.bench.speed.run_speed import PATROL, timed_run
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare


def test_every_part_of_the_patrol_takes_time() -> None:
    watch = Stopwatch()
    simulated, _, wall = timed_run(prepare(load_scenario(PATROL, PATROL.parent)), watch)
    assert simulated == 60.0
    assert {"physics", "truth and contacts", "sensors", "localizer", "planner", "controller", "trace", "log"} <= set(
        watch.seconds
    )
    assert all(seconds > 0 for seconds in watch.seconds.values()), watch.seconds
    assert sum(watch.seconds.values()) < wall
