import numpy as np

from simscen.core.geometry import Pose2
from simscen.model.stack import Costmap as Spec
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.planners.field import Field
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import RATE, Flatland, round_robot


def field(seed: int = 1) -> Field:
    chance = np.random.default_rng(seed)
    world = Flatland().room(8, 6)
    world.discs = [(*chance.uniform((0.5, 0.5), (7.5, 5.5)), 0.2) for _ in range(12)]
    grid = world.grid((-0.5, -0.5, 8.5, 6.5))
    return Field(Costmap(Spec(), Surroundings(round_robot(), grid, RATE)).view)


def test_a_segment_is_free_when_every_point_of_it_is() -> None:
    tested = field()
    chance = np.random.default_rng(2)
    answers = []
    for _ in range(500):
        a, b = chance.uniform((0, 0), (8, 6), (2, 2))
        points = a + np.linspace(0, 1, 2000)[:, None] * (b - a)
        least = tested.many(points).min()
        answer = tested.segment_free(*a, *b, 0.22)
        answers.append(answer)
        if answer:  # steps of half a cell may cut a cell's corner, never more
            assert least > 0.22 - 0.05
        else:
            assert least <= 0.22
    assert 50 < sum(answers) < 450


def test_points_and_segments_off_the_map_are_not_free() -> None:
    tested = field()
    assert tested.at(-3.0, 1.0) == -1.0
    assert not tested.segment_free(1.0, 1.0, -3.0, 1.0, 0.1)


def test_slopes_lead_away_from_walls() -> None:
    tested = field()
    distance, slope = tested.slopes(np.array([[0.3, 5.7]]))
    assert distance[0] == tested.at(0.3, 5.7)
    assert Pose2(*slope[0].tolist()).x >= 0
