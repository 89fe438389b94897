"""Tests of when the track of a moving obstacle ends, and when it counts as moving."""

from simscen.advanced.prediction.tracks import MAX_UPDATES_OUTSIDE_FREE_SPACE, Track, TrackLifecycle
from simscen.model.costmaps import Prediction
from simscen.testing.flatland import TICK_RATE_HZ


def track(*in_free_space: bool) -> Track:
    """Return a track at 0.5 m/s with updates at 10 Hz; the values tell which updates are in formerly free space."""
    result = Track.start(0, 0j, 0.02, 0.3)
    result.velocity = 0.5 + 0j
    for step, was_free in enumerate(in_free_space):
        result.last_fast_tick = TICK_RATE_HZ // 10 * step
        result.record_update(result.last_fast_tick, was_free, False, 1, 0.03)
    return result


def have_ended(*tracks: Track) -> list[bool]:
    """Return for each track whether it has ended."""
    lifecycle = TrackLifecycle(Prediction(), TICK_RATE_HZ)
    return [lifecycle.has_ended(item, item.last_update_tick, list(tracks), lambda _: True) for item in tracks]


def test_track_that_is_no_longer_in_free_space_ends() -> None:
    left_free_space, returned = (
        [True] + [False] * MAX_UPDATES_OUTSIDE_FREE_SPACE,
        [True] * 4 + [False] * (MAX_UPDATES_OUTSIDE_FREE_SPACE - 1) + [True],
    )
    assert have_ended(track(*left_free_space)) == [True]
    assert have_ended(track(*returned)) == [False]


def test_track_next_to_a_moving_obstacle_continues() -> None:
    neighbor = track(*[True] * (MAX_UPDATES_OUTSIDE_FREE_SPACE + 1))
    neighbor.is_moving = True
    assert have_ended(track(True, *[False] * MAX_UPDATES_OUTSIDE_FREE_SPACE), neighbor) == [False, False]


def test_track_that_stands_still_remembers_that_it_has_moved() -> None:
    """`has_moved` stays set, although the current scan shows no motion."""
    standing = track(*[True] * 4)
    standing.has_moved = True
    tick = standing.last_update_tick + TICK_RATE_HZ // 10
    TrackLifecycle(Prediction(), TICK_RATE_HZ).update_motion(standing, tick, [standing], lambda _: True)
    assert (standing.is_moving, standing.has_moved) == (False, True)
