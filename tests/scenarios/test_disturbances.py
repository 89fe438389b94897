"""Tests that a run fails if an event or fault has no effect."""

from pathlib import Path

import pytest

from simscen.core.records.run_result import Outcome, RunResult
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

HEAD = """\
simscen: 1
world:
  simscen: 1
  walls: [{name: outer wall, points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]
  objects: [{name: bin, box: [0.2, 0.2, 0.3], pose: {x: 5.5, y: 0.5}}]
  doors: [{name: hatch, points: [[0.4, 3.9], [0.9, 3.9]], closed: true}]
robot: {pose: {x: 1, y: 1}}
stack: {localizer: {type: ground_truth}}
goals: [{pose: {x: 4.5, y: 1}}]
time_limit: 20 s
pass: [{goals_reached: {}}]
"""


def run(text: str, folder: Path) -> tuple[RunResult, dict[str, str]]:
    """The result, and of each event and fault what became of it, after a + where it happened and a - where not."""
    file = folder / "own.scenario.yaml"
    file.write_text(HEAD + text)
    result = simulate(prepare(load_scenario(file, folder))).result
    return result, {one.disturbance.name: f"{'-+'[one.happened]} {one.effect}" for one in result.disturbances}


def complaints(result: RunResult) -> dict[str, int]:
    """The ids of what failed, and the lines they are written in."""
    pairs = zip(result.verdicts, result.lines, strict=True)
    return {verdict.id: line for verdict, line in pairs if verdict.status.value != "pass"}


ACTIONS = """\
events:
  - {name: far away, when: {robot_within: {of: [50, 50], distance: 1 m}}, do: {push: {impulse: [0, 1]}}}
  - {name: remove what never was, when: {time: 1 s}, do: {remove: {name: later}}}
  - {name: remove, when: {time: 1 s}, do: {remove: {name: bin}}}
  - {name: remove again, when: {time: 2 s}, do: {remove: {name: bin}}}
  - {name: move what is gone, when: {time: 2 s}, do: {move: {name: bin, through: [[5, 1]], speed: 1}}}
  - {name: spawn, when: {time: 2 s}, do: {spawn: {name: crate, box: [0.2, 0.2, 0.3], pose: {x: 5.5, y: 3.5}}}}
  - {name: move, when: {time: 3 s}, do: {move: {name: crate, through: [[5.5, 3]], speed: 1}}}
  - {name: move to where it is, when: {time: 5 s}, do: {move: {name: crate, through: [[5.5, 3]], speed: 1}}}
  - {name: shut what is shut, when: {time: 1 s}, do: {close: {name: hatch}}}
  - {name: open, when: {time: 2 s}, do: {open: {name: hatch}}}
  - {name: open what is open, when: {time: 5 s}, do: {open: {name: hatch}}}
  - {name: no push, when: {time: 1 s}, do: {push: {impulse: [0, 0]}}}
  - {name: push, when: {time: 1 s}, do: {push: {impulse: [0, 0.5]}}}
  - {name: kidnapped to where it is, when: {time: 0 s}, do: {kidnap: {pose: {x: 1, y: 1}}}}
  - {name: kidnapped, when: {time: 0 s}, do: {kidnap: {pose: {x: 1, y: 1.2}}}}
  - name: no plan to spawn on
    when: {goal: {status: reached}}
    do: {spawn: {name: later, box: [0.1, 0.1, 0.3], on_plan: 0.5 m}}
  - {name: nothing to cancel, when: {goal: {status: reached}, delay: 0.2 s}, do: {cancel_goal: {}}}
  - {name: half of two, when: {time: 1 s}, do: [{push: {impulse: [0, 0.1]}}, {push: {impulse: [0, 0]}}]}
  - {name: second time, when: {time: 1 s}, do: {push: {impulse: [0, 0]}}, required: false}
"""


def test_event_happens_if_each_action_has_an_effect(tmp_path):
    result, told = run(ACTIONS, tmp_path)
    happened = {"remove", "spawn", "move", "open", "push", "kidnapped"}
    assert {name for name, effect in told.items() if effect.startswith("+")} == happened
    assert result.outcome is Outcome.FAILED
    lines = (HEAD + ACTIONS).split("\n")
    line = {name: next(k for k, text in enumerate(lines, 1) if f"name: {name}," in f"{text},") for name in told}
    assert complaints(result) == {name: line[name] for name in told if name not in {*happened, "second time"}}
    assert told["remove"] == "+ removed bin"
    assert told["move to where it is"] == "- crate is already at its waypoint"
    assert told["open what is open"] == "- hatch was already open"
    assert told["nothing to cancel"] == "- the robot had no goal"
    assert told["no plan to spawn on"].endswith("because the robot had no plan")
    assert told["far away"].startswith("- it never began; the run ended at t = ")


FAULTS = """\
faults:
  - {sensor: lidar, off: {}, when: {time: 2.01 s}, for: 0.01 s, required: false}
  - {sensor: lidar, name: one message, off: {}, when: {time: 2.95 s}, for: 0.1 s}
  - {sensor: odom, name: before it drives, bias: {linear_scale: 1.5}, for: 0.025 s}
  - {sensor: odom, slip: {left: 5 %}, when: {time: 2 s}}
  - {sensor: lidar, dropout: {probability: 0.001 %}}
  - {sensor: lidar, name: dead, off: {}, when: {time: 4 s}, for: 1 s}
  - {sensor: lidar, name: noise of the dead, noise: {std: 1 cm}, when: {time: 4 s}, for: 1 s}
  - {sensor: lidar, name: noise, noise: {std: 1 cm}, when: {time: 5 s}, for: 1 s}
  - {sensor: lidar, name: to the end, off: {}, when: {time: 6 s}}
"""


def test_fault_happens_if_it_changes_a_message_or_command(tmp_path):
    result, told = run(FAULTS, tmp_path)
    assert {name for name, effect in told.items() if effect.startswith("+")} == {
        "one message", "odom.slip", "dead", "noise", "to the end",
    }  # fmt: skip
    assert told["one message"] == "+ disturbed lidar once, first at t = 3.00 s"
    assert told["dead"] == "+ disturbed lidar 10 times"
    assert told["noise of the dead"] == "- it changed no message of lidar from t = 4.00 s to t = 5.00 s"
    assert set(complaints(result)) >= {"before it drives", "lidar.dropout", "noise of the dead"}
    assert "lidar.off" in told
    assert "lidar.off" not in complaints(result), "it may stay away"


def test_event_in_the_last_cycle_did_not_happen(tmp_path):
    text = """\
events: [{name: too late, when: {time: 19.996 s}, do: {push: {impulse: [0, 1]}}}]
faults: [{sensor: lidar, off: {}, when: {time: 19.996 s}}]
linger: 60
"""
    result, told = run(text, tmp_path)
    assert complaints(result).keys() == {"too late", "lidar.off"}
    assert told["too late"] == told["lidar.off"] == "- it began only when the run ended at t = 20.00 s (time limit)"


CHANCE = "events: [{{name: maybe, when: {{time: 1 s, probability: {}}}, do: {{push: {{impulse: [0, 0.1]}}}}{}}}]\n"


@pytest.mark.parametrize(
    ("probability", "required", "outcome"),
    [("1 %", "", Outcome.FAILED), ("1 %", ", required: false", Outcome.PASSED), ("99 %", "", Outcome.PASSED)],
)
def test_event_excluded_by_probability_did_not_happen(probability, required, outcome, tmp_path):
    result, _ = run(CHANCE.format(probability, required), tmp_path)
    assert result.outcome is outcome


STORIES = """\
events:
  - name: a story
    when: {time: 1 s}
    do: {push: {impulse: [0, 0.01]}}
    then:
      - {when: {time: 500 ms}}
      - {when: {collision: {}}, do: {remove: {name: bin}}}
      - {name: the end, when: {time: 1 s}, do: {open: {name: hatch}}}
      - {name: may stay away, do: {close: {name: hatch}}, required: false}
  - name: another
    when: {time: 2 s}
    required: false
    then:
      - {name: never, when: {collision: {}}}
      - {name: nor this, do: {push: {impulse: [1, 0]}}}
      - {name: but this should, do: {push: {impulse: [1, 0]}}, required: true}
"""


def test_stopped_sequence_fails_at_the_pending_step(tmp_path: Path) -> None:
    result, told = run(STORIES, tmp_path)
    assert complaints(result) == {"a story then 2": 18, "but this should": 27}
    since = "it was due from t = 1.50 s, after a story then 1; it never began"
    assert told["a story then 1"] == "+ its trigger fired"
    assert told["a story then 2"].startswith(f"- {since}")
    assert told["the end"].startswith("- it was not due, because a story then 2 had not happened; it never began")
    assert told["but this should"].startswith("- it was not due, because never had not happened")
    assert result.outcome is Outcome.FAILED
