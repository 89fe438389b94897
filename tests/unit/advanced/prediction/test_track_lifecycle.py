"""Tests of the life cycle of tracks."""

from simscen.advanced.prediction.tracks import MAX_UPDATES_OUTSIDE_FREE_SPACE, Track, TrackLifecycle
from simscen.model.costmaps import Prediction
from simscen.testing.flatland import TICK_RATE_HZ


def track(*in_free_space: bool) -> Track:
    """Return a track at 0.5 m/s with updates at 10 Hz, each in formerly free space or not."""
    result = Track.start(0, 0j, 0.02, 0.3)
    result.velocity = 0.5 + 0j
    for step, was_free in enumerate(in_free_space):
        result.last_fast_tick = TICK_RATE_HZ // 10 * step
        result.record_update(result.last_fast_tick, was_free, False, 1, 0.03)
    return result


def ended(*tracks: Track) -> list[bool]:
    lifecycle = TrackLifecycle(Prediction(), TICK_RATE_HZ)
    return [lifecycle.has_ended(one, one.last_update_tick, list(tracks), lambda _: True) for one in tracks]


def test_track_that_is_no_longer_in_free_space_ends() -> None:
    left_free_space, returned = (
        [True] + [False] * MAX_UPDATES_OUTSIDE_FREE_SPACE,
        [True] * 4 + [False] * (MAX_UPDATES_OUTSIDE_FREE_SPACE - 1) + [True],
    )
    assert ended(track(*left_free_space)) == [True]
    assert ended(track(*returned)) == [False]


def test_track_next_to_a_moving_obstacle_continues() -> None:
    neighbor = track(*[True] * (MAX_UPDATES_OUTSIDE_FREE_SPACE + 1))
    neighbor.is_moving = True
    assert ended(track(True, *[False] * MAX_UPDATES_OUTSIDE_FREE_SPACE), neighbor) == [False, False]


def test_track_that_has_moved_is_remembered_while_it_stands() -> None:
    """A scan in which the obstacle is not seen is no proof that it never moved."""
    one = track(*[True] * 4)
    one.has_moved = True
    tick = one.last_update_tick + TICK_RATE_HZ // 10
    TrackLifecycle(Prediction(), TICK_RATE_HZ).update_motion(one, tick, [one], lambda _: True)
    assert (one.is_moving, one.has_moved) == (False, True)
