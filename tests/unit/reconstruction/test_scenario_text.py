"""Tests of the text of a reconstructed scenario, which is loaded again."""

from pathlib import Path

import pytest

from simscen.core.geometry import Pose2
from simscen.loading.scenario import load_scenario
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.scenario.contents import EstimatedParts, GivenParts, ScenarioContents, ScenarioGoal
from simscen.reconstruction.scenario.criteria import ProposedCriterion
from simscen.reconstruction.scenario.scenario_text import scenario_text

WORLD = {"simscen": 1, "walls": [{"points": [[0, 0], [9, 0], [9, 6], [0, 6], [0, 0]]}]}
SEEN = Reason("seen in 40 scans", 1.0, 5.0)


def contents(**changes):
    values = {
        "name": "drive: 3, #4",
        "source": "run.mcap",
        "summary": ["Reconstructed from a drive."],
        "given": GivenParts(WORLD, "", "turtlebot", 7),
        "estimated": EstimatedParts([]),
        "start": Pose2(1.0, 3.0, 0.5),
        "estimate": None,
        "passing_radius": None,
        "goals": [ScenarioGoal("a, b: {c}", Pose2(7.0, 3.0), 60.0, Reason("/goal_pose", 0.0, 20.0))],
        "stops_at_failure": True,
        "time_limit": 100.0,
        "criteria": [ProposedCriterion("goals_reached", {}, Reason("held: all goals were reached"))],
        "reasons": {},
        "unknowns": ["the footprint"],
    }
    return ScenarioContents(**{**values, **changes})


def write_and_load(tmp_path: Path, **changes):
    """Write a scenario with changed contents; return the loaded scenario and its text."""
    file = tmp_path / "drive.scenario.yaml"
    text = scenario_text(contents(**changes))
    file.write_text(text)
    return load_scenario(file, tmp_path), text


def test_names_with_any_characters_survive(tmp_path):
    scenario, _ = write_and_load(tmp_path)
    assert scenario.spec.name == "drive: 3, #4"
    assert scenario.spec.goal_names == ["a, b: {c}"]


def test_unknown_values_are_noted_at_the_top(tmp_path):
    _, text = write_and_load(tmp_path)
    assert text.index("# - the footprint") < text.index("simscen: 1")


@pytest.mark.parametrize("estimate", ["unknown", (Pose2(1.2, 3.1, 0.4), (0.3, 0.2, 0.1))])
def test_the_initial_estimate_is_written(tmp_path, estimate):
    scenario, _ = write_and_load(tmp_path, estimate=estimate)
    written = scenario.spec.only_robot.initial_estimate
    assert written == "unknown" if estimate == "unknown" else written.std == pytest.approx((0.3, 0.2, 0.1), abs=0.01)


def test_objects_become_events_with_their_reasons(tmp_path):
    box = FoundObject("cart", (0.9, 0.6), ((2.0, 4.0, 1.0, 1.57), (4.0, 4.0, 3.0, 1.57)), 2.0, 6.0, SEEN)
    column = FoundObject("column", (0.2,), ((0.0, 5.0, 5.0, 0.0),), None, None, SEEN)
    scenario, text = write_and_load(tmp_path, estimated=EstimatedParts([], objects=[box, column]))
    names = [event.name for event in scenario.spec.events]
    assert names == ["cart appears", "cart disappears", "column is there"]
    times = [event.when.time.root for event in scenario.spec.events]
    assert times == [2.0, 6.0, 0.0]
    assert text.count("# seen in 40 scans, t = 1.00 s to 5.00 s (confidence: high)") == 2


def test_faults_have_their_time_and_duration(tmp_path):
    fault = FoundFault("lidar", "off", {}, 3.0, 2.5, SEEN)
    scenario, _ = write_and_load(tmp_path, estimated=EstimatedParts([], faults=[fault]))
    (entry,) = scenario.spec.faults
    assert (entry.sensor, entry.kind, entry.for_) == ("lidar", "off", 2.5)


def test_a_kidnapping_becomes_an_event(tmp_path):
    kidnap = 4.0, Pose2(2.0, 5.0, 0.0), SEEN
    scenario, _ = write_and_load(tmp_path, estimated=EstimatedParts([], kidnaps=[kidnap]))
    (event,) = scenario.spec.events
    assert event.do is not None


def test_goals_that_were_passed_without_a_stop_have_the_radius_of_the_log(tmp_path):
    scenario, text = write_and_load(tmp_path, passing_radius=0.5, reasons={"navigation": SEEN})
    assert scenario.spec.navigation.mode == "navigate_through_poses"
    assert scenario.spec.navigation.radius == 0.5
    assert "# seen in 40 scans" in text
