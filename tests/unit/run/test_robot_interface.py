"""Tests of the schedule of ticks at which a sensor or the stack is due."""

from hypothesis import given
from hypothesis import strategies as st

from simscen.run.robot_interface import TickSchedule


@given(st.lists(st.sampled_from([1, 2, 3, 4, 6, 8, 12, 24, 48, 7]), min_size=1, max_size=4))
def test_exactly_the_multiples_of_all_periods_are_visited(periods):
    schedule, tick, visited = TickSchedule(periods), 0, []
    while tick < 500:
        tick += schedule.ticks_until_next(tick)
        visited.append(tick)
    due = [t for t in range(1, visited[-1] + 1) if any(t % period == 0 for period in periods)]
    assert visited == due


@given(st.lists(st.tuples(st.sampled_from([3, 4, 6, 12, 24]), st.integers(0, 60)), min_size=1, max_size=4))
def test_phase_shifted_events_are_visited_at_their_tick(periods_and_phases):
    schedule, tick, visited = TickSchedule([24], periods_and_phases), 0, []
    while tick < 300:
        tick += schedule.ticks_until_next(tick)
        visited.append(tick)
    beats = [(24, 0), *periods_and_phases]
    assert visited == [
        t for t in range(1, visited[-1] + 1) if any((t - phase) % period == 0 for period, phase in beats)
    ]
