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
    """Simulate; return the result and the effect of each event and fault, with "+" if it happened, else "-"."""
    file = folder / "own.scenario.yaml"
    file.write_text(HEAD + text)
    result = simulate(prepare(load_scenario(file, folder))).result
    outcomes = result.disturbances
    return result, {each.disturbance.name: f"{'-+'[each.happened]} {each.effect}" for each in outcomes}


def failed_lines(result: RunResult) -> dict[str, int]:
    """Return the ids of failed verdicts, and their lines in the scenario."""
    pairs = zip(result.verdicts, result.lines, strict=True)
    return {verdict.id: line for verdict, line in pairs if verdict.status.value != "pass"}


ACTIONS = """\
events:
  - {name: far away, when: {robot_within: {of: [50, 50], distance: 1 m}}, do: {push: {impulse: [0, 1]}}}
  - {name: remove a missing object, when: {time: 1 s}, do: {remove: {name: later}}}
  - {name: remove, when: {time: 1 s}, do: {remove: {name: bin}}}
  - {name: remove again, when: {time: 2 s}, do: {remove: {name: bin}}}
  - {name: move a removed object, when: {time: 2 s}, do: {move: {name: bin, through: [[5, 1]], speed: 1}}}
  - {name: spawn, when: {time: 2 s}, do: {spawn: {name: crate, box: [0.2, 0.2, 0.3], pose: {x: 5.5, y: 3.5}}}}
  - {name: move, when: {time: 3 s}, do: {move: {name: crate, through: [[5.5, 3]], speed: 1}}}
  - {name: move to the same place, when: {time: 5 s}, do: {move: {name: crate, through: [[5.5, 3]], speed: 1}}}
  - {name: close a closed door, when: {time: 1 s}, do: {close: {name: hatch}}}
  - {name: open, when: {time: 2 s}, do: {open: {name: hatch}}}
  - {name: open an open door, when: {time: 5 s}, do: {open: {name: hatch}}}
  - {name: no push, when: {time: 1 s}, do: {push: {impulse: [0, 0]}}}
  - {name: push, when: {time: 1 s}, do: {push: {impulse: [0, 0.5]}}}
  - {name: kidnapped to the same place, when: {time: 0 s}, do: {kidnap: {pose: {x: 1, y: 1}}}}
  - {name: kidnapped, when: {time: 0 s}, do: {kidnap: {pose: {x: 1, y: 1.2}}}}
  - name: no plan to spawn on
    when: {goal: {status: reached}}
    do: {spawn: {name: later, box: [0.1, 0.1, 0.3], on_plan: 0.5 m}}
  - {name: nothing to cancel, when: {goal: {status: reached}, delay: 0.2 s}, do: {cancel_goal: {}}}
  - {name: half of two, when: {time: 1 s}, do: [{push: {impulse: [0, 0.1]}}, {push: {impulse: [0, 0]}}]}
  - {name: second time, when: {time: 1 s}, do: {push: {impulse: [0, 0]}}, required: false}
"""


def test_event_happens_if_each_action_has_an_effect(tmp_path):
    result, effects = run(ACTIONS, tmp_path)
    happened = {"remove", "spawn", "move", "open", "push", "kidnapped"}
    assert {name for name, effect in effects.items() if effect.startswith("+")} == happened
    assert result.outcome is Outcome.FAILED
    lines = (HEAD + ACTIONS).split("\n")
    line = {name: next(k for k, text in enumerate(lines, 1) if f"name: {name}," in f"{text},") for name in effects}
    assert failed_lines(result) == {name: line[name] for name in effects if name not in {*happened, "second time"}}
    assert effects["remove"] == "+ removed bin"
    assert effects["move to the same place"] == "- crate is already at its waypoint"
    assert effects["open an open door"] == "- hatch was already open"
    assert effects["nothing to cancel"] == "- the robot had no goal"
    assert effects["no plan to spawn on"].endswith("because the robot had no plan")
    assert effects["far away"].startswith("- it never began; the run ended at t = ")


FAULTS = """\
faults:
  - {sensor: lidar, off: {}, when: {time: 2.01 s}, for: 0.01 s, required: false}
  - {sensor: lidar, name: one message, off: {}, when: {time: 2.95 s}, for: 0.1 s}
  - {sensor: odom, name: before it drives, bias: {linear_scale: 1.5}, for: 0.025 s}
  - {sensor: odom, slip: {left: 5 %}, when: {time: 2 s}}
  - {sensor: lidar, dropout: {probability: 0.001 %}}
  - {sensor: lidar, name: lidar off, off: {}, when: {time: 4 s}, for: 1 s}
  - {sensor: lidar, name: noise while off, noise: {std: 1 cm}, when: {time: 4 s}, for: 1 s}
  - {sensor: lidar, name: noise, noise: {std: 1 cm}, when: {time: 5 s}, for: 1 s}
  - {sensor: lidar, name: to the end, off: {}, when: {time: 6 s}}
"""


def test_fault_happens_if_it_changes_a_message_or_command(tmp_path):
    result, effects = run(FAULTS, tmp_path)
    assert {name for name, effect in effects.items() if effect.startswith("+")} == {
        "one message", "odom.slip", "lidar off", "noise", "to the end",
    }  # fmt: skip
    assert effects["one message"] == "+ disturbed lidar once, first at t = 3.00 s"
    assert effects["lidar off"] == "+ disturbed lidar 10 times"
    assert effects["noise while off"] == "- it changed no message of lidar from t = 4.00 s to t = 5.00 s"
    assert set(failed_lines(result)) >= {"before it drives", "lidar.dropout", "noise while off"}
    assert "lidar.off" in effects
    assert "lidar.off" not in failed_lines(result), "it is optional"


def test_event_in_the_last_cycle_did_not_happen(tmp_path):
    text = """\
events: [{name: too late, when: {time: 19.996 s}, do: {push: {impulse: [0, 1]}}}]
faults: [{sensor: lidar, off: {}, when: {time: 19.996 s}}]
linger: 60
"""
    result, effects = run(text, tmp_path)
    assert failed_lines(result).keys() == {"too late", "lidar.off"}
    effect = "- it began only when the run ended at t = 20.00 s (time limit)"
    assert effects["too late"] == effects["lidar.off"] == effect


RANDOM = "events: [{{name: maybe, when: {{time: 1 s, probability: {}}}, do: {{push: {{impulse: [0, 0.1]}}}}{}}}]\n"


@pytest.mark.parametrize(
    ("probability", "required", "outcome"),
    [("1 %", "", Outcome.FAILED), ("1 %", ", required: false", Outcome.PASSED), ("99 %", "", Outcome.PASSED)],
)
def test_event_excluded_by_probability_did_not_happen(probability, required, outcome, tmp_path):
    result, _ = run(RANDOM.format(probability, required), tmp_path)
    assert result.outcome is outcome


SEQUENCES = """\
events:
  - name: sequence
    when: {time: 1 s}
    do: {push: {impulse: [0, 0.01]}}
    then:
      - {when: {time: 500 ms}}
      - {when: {collision: {}}, do: {remove: {name: bin}}}
      - {name: the end, when: {time: 1 s}, do: {open: {name: hatch}}}
      - {name: optional step, do: {close: {name: hatch}}, required: false}
  - name: another
    when: {time: 2 s}
    required: false
    then:
      - {name: never, when: {collision: {}}}
      - {name: skipped step, do: {push: {impulse: [1, 0]}}}
      - {name: required step, do: {push: {impulse: [1, 0]}}, required: true}
"""


def test_stopped_sequence_fails_at_the_pending_step(tmp_path: Path) -> None:
    result, effects = run(SEQUENCES, tmp_path)
    assert failed_lines(result) == {"sequence then 2": 18, "required step": 27}
    reason = "it was due from t = 1.50 s, after sequence then 1; it never began"
    assert effects["sequence then 1"] == "+ its trigger fired"
    assert effects["sequence then 2"].startswith(f"- {reason}")
    assert effects["the end"].startswith("- it was not due, because sequence then 2 had not happened; it never began")
    assert effects["required step"].startswith("- it was not due, because never had not happened")
    assert result.outcome is Outcome.FAILED
