"""Tests of the times and the order of events."""

import numpy as np
import pytest

CANCEL = "events: [{when: {time: 1 s}, do: {cancel_goal: {}}}]\n"
NEW_GOAL = "events: [{when: {time: 1 s}, do: {new_goal: {name: b, pose: {x: 2, y: 1}}}}]\n"


@pytest.mark.parametrize("extra", [CANCEL, NEW_GOAL])
@pytest.mark.parametrize("controller", [20, 5])
def test_stack_reaction_is_logged_at_the_tick_of_the_event(play, extra, controller):
    trace = play(extra, stack=f"{{controller_frequency: {controller} Hz}}")
    (cause,), effect = trace.of_kind("event.started"), trace.of_kind("goal.canceled")[0]
    assert cause.tick == effect.tick == 240
    assert trace.events.index(cause) < trace.events.index(effect)


def test_events_are_logged_in_the_order_in_which_they_happened(play):
    extra = (
        "events: [{when: {time: 1 s}, do: {push: {impulse: [0, 30]}}}, {when: {time: 2 s}, do: {cancel_goal: {}}}]\n"
    )
    trace = play(extra, physics="{truth_rate: 20 Hz}", robot="{pose: {x: 1, y: 0.5, yaw: 0}}")
    ticks = [event.tick for event in trace.events]
    assert ticks == sorted(ticks)


@pytest.mark.parametrize("truth_rate", [40, 120, 20])
def test_truth_rate_changes_triggers_by_at_most_one_sample(play, truth_rate):
    """Time triggers are exact. Place triggers are checked at each sample of the ground truth, at 40 Hz or more."""
    extra = """\
events:
  - {name: by time, when: {time: 1.05 s}, do: {spawn: {name: box, box: [0.1, 0.1, 0.1], pose: {x: 7, y: 5}}}}
  - {name: by place, when: {robot_within: {of: [2, 1], distance: 0.2}}, do: {remove: {name: box}}}
faults:
  - {sensor: odom, bias: {linear_scale: 1.0}, when: {time: 0.3 s}, for: 150 ms}
"""
    trace = play(extra, physics=f"{{truth_rate: {truth_rate} Hz}}")
    ticks = {(str(e.kind), e.name): e.tick for e in trace.of_kind("event.started", "fault.started", "fault.ended")}
    assert ticks["event.started", "by time"] == 252
    assert (ticks["fault.started", "odom.bias"], ticks["fault.ended", "odom.bias"]) == (72, 108)
    tick_at_40_hz = play(extra).of_kind("event.started")[1].tick
    earlier = 6 if truth_rate > 40 else 0  # a higher rate detects the place earlier, by less than a sample at 40 Hz
    assert tick_at_40_hz - earlier <= ticks["event.started", "by place"] <= tick_at_40_hz


@pytest.mark.parametrize("position", [(7, 5), (1.2, 1)])
def test_kidnapping_does_not_count_as_driven_distance(play, position):
    x, y = position
    extra = f"""\
events:
  - {{name: away, when: {{time: 1 s}}, do: {{kidnap: {{pose: {{x: {x}, y: {y}}}}}}}}}
  - {{name: far, when: {{travelled: 1.5 m}}, do: {{cancel_goal: {{}}}}}}
"""
    trace = play(extra, time_limit="20", stack="{localizer: {type: ground_truth}}")
    away, far = trace.of_kind("event.started")
    assert far.name == "far"
    steps = np.hypot(*np.diff(trace.truth.values[:, :2], axis=0).T)
    steps[np.searchsorted(trace.truth.ticks, away.tick, side="right") - 1] = 0.0
    driven = steps[: np.searchsorted(trace.truth.ticks, far.tick)].sum()
    assert driven == pytest.approx(1.5, abs=0.03)
