"""Test that `simscen bench` measures all parts of a run."""

import shutil
from pathlib import Path

from simscen.bench.speed.measurement import Stopwatch
from simscen.bench.speed.run_speed import PATROL, time_run
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare


def test_every_part_of_the_patrol_takes_time(tmp_path: Path) -> None:
    """The patrol of `simscen bench` is 60 s long; 15 s are enough for this test."""
    text = PATROL.read_text(encoding="utf-8")
    assert "time_limit: 60 s" in text
    shorter = tmp_path / "patrol" / PATROL.name
    shutil.copytree(PATROL.parent, shorter.parent)
    shorter.write_text(text.replace("time_limit: 60 s", "time_limit: 15 s"), encoding="utf-8")
    watch = Stopwatch()
    simulated, _, wall = time_run(prepare(load_scenario(shorter, shorter.parent)), watch)
    assert simulated == 15.0
    assert {"physics", "truth and contacts", "sensors", "localizer", "planner", "controller", "trace", "log"} <= set(
        watch.seconds
    )
    assert all(seconds > 0 for seconds in watch.seconds.values()), watch.seconds
    assert sum(watch.seconds.values()) < wall
