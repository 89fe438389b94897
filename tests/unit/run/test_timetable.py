from hypothesis import given
from hypothesis import strategies as st

from simscen.run.timetable import Timetable


@given(st.lists(st.sampled_from([1, 2, 3, 4, 6, 8, 12, 24, 48, 7]), min_size=1, max_size=4))
def test_every_tick_at_which_something_is_due_is_visited_and_no_other(periods):
    table, tick, visited = Timetable(periods), 0, []
    while tick < 500:
        tick += table.until_next(tick)
        visited.append(tick)
    due = [t for t in range(1, visited[-1] + 1) if any(t % period == 0 for period in periods)]
    assert visited == due
