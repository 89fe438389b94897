"""Tests of the life cycle of tracks."""

from simscen.advanced.prediction.tracks import MAX_UPDATES_OUTSIDE_FREE_SPACE, Track, TrackLifecycle
from simscen.model.guards import Prediction
from simscen.testing.flatland import TICK_RATE_HZ


def track(*came: bool) -> Track:
    """At 0.5 m/s along x and hit at ten scans a second: it stood where it had been free, or not."""
    found = Track.start(0, 0j, 0.02, 0.3)
    found.velocity = 0.5 + 0j
    for step, one in enumerate(came):
        found.last_fast_tick = TICK_RATE_HZ // 10 * step
        found.record_update(found.last_fast_tick, one, False, 1, 0.03)
    return found


def ended(*tracks: Track) -> list[bool]:
    going = TrackLifecycle(Prediction(), TICK_RATE_HZ)
    return [going.has_ended(each, each.last_update_tick, list(tracks), lambda _: True) for each in tracks]


def test_track_that_is_no_longer_in_free_space_ends() -> None:
    slides, comes = (
        [True] + [False] * MAX_UPDATES_OUTSIDE_FREE_SPACE,
        [True] * 4 + [False] * (MAX_UPDATES_OUTSIDE_FREE_SPACE - 1) + [True],
    )
    assert ended(track(*slides)) == [True]
    assert ended(track(*comes)) == [False]


def test_track_next_to_a_moving_obstacle_continues() -> None:
    beside = track(*[True] * (MAX_UPDATES_OUTSIDE_FREE_SPACE + 1))
    beside.is_moving = True
    assert ended(track(True, *[False] * MAX_UPDATES_OUTSIDE_FREE_SPACE), beside) == [False, False]
