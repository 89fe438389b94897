"""Which tracks are followed on, from updates written down by hand."""

import numpy as np

from simscen.model.guards import Prediction
from simscen.stack.prediction.going import UNCOME, Going
from simscen.stack.prediction.tracks import Track, Tracks
from simscen.testing.flatland import RATE


def tracks(*came: list[bool]) -> Tracks:
    """One for each list, at 0.5 m/s along x and hit at ten scans a second: it stood where it had been free, or not."""
    found = Tracks()
    found.begin([Track(0.3, np.zeros(2)) for _ in came], np.zeros((len(came), 2)), np.full(len(came), 0.02))
    found.states[:, 2] = 0.5
    for number, each in enumerate(came):
        for step, one in enumerate(each):
            found.tick = RATE // 10 * step
            found.note(number, one, False, 1)
        found.known[number].fast_at = found.tick
    return found


def ended(found: Tracks) -> list[bool]:
    return [Going(Prediction(), RATE).ended(found, number, lambda _: True) for number in range(len(found))]


def test_what_never_again_stands_where_it_was_free_is_a_wall_that_comes_into_view_and_followed_no_more() -> None:
    slides, comes = [True] + [False] * UNCOME, [True] * 4 + [False] * (UNCOME - 1) + [True]
    assert ended(tracks(slides)) == [True]
    assert ended(tracks(comes)) == [False]


def test_beside_something_that_moves_it_is_followed_on_for_that_may_have_hidden_the_place() -> None:
    found = tracks([True] + [False] * UNCOME, [True] * (UNCOME + 1))
    found.known[1].moving = True
    assert ended(found) == [False, False]
