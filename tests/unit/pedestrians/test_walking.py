"""Tests of the social force model against closed forms and published observations."""

import math

import numpy as np
import pytest

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.pedestrians import forces
from tests.unit.pedestrians.rig import STEP, corridor, people, walk, walker, walls


def test_single_pedestrian_accelerates_as_in_helbing_and_molnar():
    """v(t) = v0 (1 - exp(-t/τ)), and the way is its integral."""
    tracks, _ = walk(people(walker("anna", 0.0, 0.0, (50.0, 0.0), speed=1.3)), 3.0)
    t, tau = np.arange(61) * STEP, forces.RELAXATION_TIME_S
    assert tracks["anna"][:, 0] == pytest.approx(1.3 * (t - tau * (1 - np.exp(-t / tau))), abs=1e-9)
    assert not tracks["anna"][:, 1:].any()


def test_pedestrian_stops_where_wall_force_equals_driving_force():
    """a exp(-gap/b) = v0/τ, so the gap is b ln(a τ / v0); the way on leads through the wall."""
    crowd = people(walker("anna", 0.0, 0.0, (50.0, 0.0), speed=1.3), around=walls([[5.0, -9.0], [5.0, 9.0]]))
    tracks, _ = walk(crowd, 20.0)
    gap = forces.WALL_RANGE_M * math.log(forces.WALL_STRENGTH_M_S2 * forces.RELAXATION_TIME_S / 1.3)
    assert 5.0 - tracks["anna"][-1, 0] - 0.25 == pytest.approx(gap, abs=1e-3)


def test_one_step_of_the_interaction_is_that_of_the_paper():
    """Moussaïd et al. 2009, equations 3 to 6, written out for one pair."""
    place, motion = np.array([2.0, 0.4]), np.array([2.4, 0.1])
    distance = math.hypot(*place)
    d = 2.0 * motion + place / distance
    length = math.hypot(*d)
    t, b = d / length, 0.35 * length
    n = np.array([-t[1], t[0]])
    theta = math.atan2(place @ n, place @ t) + 0.005 * b
    f = -4.5 * math.exp(-distance / b) * (
        math.exp(-((3.0 * b * theta) ** 2)) * t + math.copysign(1, theta) * math.exp(-((2.0 * b * theta) ** 2)) * n
    )  # fmt: skip
    assert forces.social_forces(place[None], motion[None], np.zeros(1))[0] == pytest.approx(f, rel=1e-12)


def test_head_on_pedestrians_pass_on_the_right():
    """Moussaïd et al. 2009: 1.75 m wide, most evade to the right. They have begun to before they are 2 m apart."""
    crowd = people(walker("anna", -5.0, 0.0, (9.0, 0.0)), walker("bert", 5.0, 0.0, (-9.0, 0.0)), around=corridor(1.75))
    tracks, _ = walk(crowd, 10.0)
    anna, bert = tracks["anna"], tracks["bert"]
    apart = np.hypot(*(anna - bert)[:, :2].T)
    passing = int(np.argmin(np.abs(anna[:, 0] - bert[:, 0])))
    assert anna[passing, 1] < 0 < bert[passing, 1]
    assert 0.5 < bert[passing, 1] - anna[passing, 1] < 1.75 - 0.5
    before = int(np.argmax(apart < 2.0))
    assert bert[before, 1] - anna[before, 1] > 0.1
    assert apart.min() > 0.5
    assert anna[-1, 0] > 4.0 and bert[-1, 0] < -4.0


def order(rows: np.ndarray, directions: np.ndarray, width: float = 0.5) -> float:
    """Lane formation (Rex and Löwen, Physical Review E 75, 2007; Nowak and Schadschneider, ibid. 85, 2012).

    The mean over all of ((L - O) / (L + O))², where L of those in the same lane walk as they do, and O the other way.
    """
    lane = np.abs(rows[:, np.newaxis] - rows) < 0.75 * width
    same = directions[:, np.newaxis] == directions
    alike, other = (lane & same).sum(axis=1), (lane & ~same).sum(axis=1)
    return float((((alike - other) / (alike + other)) ** 2).mean())


def two_way(seed: int, rng: np.random.Generator) -> tuple[float, float]:
    """Order of those in the middle of a corridor while two crowds walk through each other, and that of shuffles."""
    drawn = np.random.default_rng(seed)
    crowd = people(around=corridor(5.0))
    for number in range(32):
        direction = 1.0 if number % 2 else -1.0
        x, y = -direction * (3.0 + 1.2 * (number // 2)), drawn.uniform(-2.1, 2.1)
        crowd.add(walker(f"p{number:02}", x, y, (90.0 * direction, y), speed=float(drawn.normal(1.29, 0.19))))
    tracks, _ = walk(crowd, 13.0)
    everybody = np.stack(list(tracks.values()))
    directions = np.where(np.arange(32) % 2, 1.0, -1.0)
    orders, shuffled = [], []
    for step in range(160, 261, 20):
        there = np.abs(everybody[:, step, 0]) < 7.0
        rows, ways = everybody[there, step, 1], directions[there]
        orders.append(order(rows, ways))
        shuffled += [order(rows, rng.permutation(ways)) for _ in range(20)]
    return float(np.mean(orders)), float(np.mean(shuffled))


@pytest.mark.slow
def test_lanes_form_where_two_crowds_walk_through_each_other():
    """Their order is more than twice that of the same people with shuffled directions, and above it in every crowd."""
    rng = np.random.default_rng(1)
    found = np.array([two_way(seed, rng) for seed in range(3)])
    assert (found[:, 0] > found[:, 1]).all(), found
    assert found[:, 0].mean() > 2 * found[:, 1].mean(), found


def test_group_members_walk_side_by_side():
    """Members stay within (N - 1)/2 m of the center of the group; pedestrians without a group drift apart."""

    def spread(group: str | None) -> np.ndarray:
        goal = (40.0, 0.0)
        crowd = people(*(walker(f"p{k}", 0.0, 1.5 * k - 1.5, goal, speed=1.0 + 0.2 * k, group=group) for k in range(3)))
        tracks, _ = walk(crowd, 15.0)
        ends = np.array([track[-1, :2] for track in tracks.values()])
        return np.hypot(*(ends - ends.mean(axis=0)).T)

    assert spread("friends").max() < 1.4
    assert spread(None).max() > 2.5


def test_pedestrians_do_not_walk_through_walls_or_each_other():
    """Fifty pedestrians in a hurry pass through one door."""
    rng = np.random.default_rng(5)
    box = [[[0, 0], [8, 0]], [[8, 0], [8, 8]], [[8, 8], [0, 8]], [[0, 8], [0, 0]]]
    crowd = people(around=walls(*box, [[0, 4], [3.4, 4]], [[4.6, 4], [8, 4]]))
    spots = [(x, y) for x in np.arange(0.5, 7.6, 0.7) for y in np.arange(0.5, 3.6, 0.7)][:50]
    for number, (x, y) in enumerate(spots):
        crowd.add(walker(f"p{number:02}", x, y, (float(rng.uniform(3.9, 4.1)), 7.7), speed=2.0))
    tracks, _ = walk(crowd, 8.0)
    ways = np.stack([track[:, :2] for track in tracks.values()], axis=1)
    apart = np.hypot(*np.moveaxis(ways[:, :, None] - ways[:, None], 3, 0)) + 9 * np.eye(len(spots))
    assert apart.min() >= 0.5 - 1e-9
    assert ways.min() >= 0.25 - 1e-9 and ways.max() <= 7.75 + 1e-9
    beside = np.abs(ways[..., 1] - 4.0)
    assert (beside[np.abs(ways[..., 0] - 4.0) > 0.6] >= 0.25 - 1e-9).all()
    assert (ways[-1, :, 1] > 4.0).sum() >= 5


def test_goals_are_visited_once_in_a_loop_or_back_and_forth():
    def reached(repeat: str) -> list[str]:
        crowd = people(walker("anna", 0.0, 0.0, (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), repeat=repeat))
        return [event.goal_or_robot for event in walk(crowd, 20.0)[1]]

    assert reached("once") == ["1", "2", "3"]
    assert reached("loop")[:7] == ["1", "2", "3", "1", "2", "3", "1"]
    assert reached("back_and_forth")[:7] == ["1", "2", "3", "2", "1", "2", "3"]


def test_pedestrian_stays_at_the_last_goal():
    tracks, events = walk(people(walker("anna", 0.0, 0.0, (3.0, 0.0))), 12.0)
    assert [event.kind for event in events] == ["reached"]
    assert tracks["anna"][-1, :2] == pytest.approx([3.0, 0.0], abs=0.06)
    assert tracks["anna"][-1, 0] == tracks["anna"][-20, 0]


def test_equal_pedestrians_walk_bit_identical_paths():
    def run() -> bytes:
        crowd = people(*(walker(f"p{k}", 2.0 * k, k % 3 - 1.0, (20.0 - 2 * k, 0.0)) for k in range(8)))
        return b"".join(track.tobytes() for track in walk(crowd, 10.0)[0].values())

    assert run() == run()


@pytest.mark.parametrize("name", ["a first", "m between", "z last"])
def test_additional_pedestrian_changes_others_only_after_meeting(name):
    def run(*more: WalkingPedestrian) -> np.ndarray:
        crowd = people(*(walker(f"m{k}", 1.1 * k, k % 3 - 1.0, (9.0 - k, 0.0), group="g" if k > 4 else None)
                         for k in range(8)), *more, around=corridor(8.0))  # fmt: skip
        tracks, _ = walk(crowd, 6.0)
        return np.stack([track for name, track in tracks.items() if name.startswith("m") and name != "m between"])

    assert (run() == run(walker(name, 40.0, 0.0, (60.0, 0.0)))).all()
    assert not (run() == run(walker(name, 12.0, 0.5, (0.0, 0.5)))).all()


def test_walls_hide_people_from_each_other():
    """Two pedestrians on both sides of a wall walk straight past each other."""
    wall = walls([[-9.0, 0.0], [9.0, 0.0]])
    crowd = people(walker("anna", -4.0, -1.5, (8.0, -1.5)), walker("bert", 4.0, 1.5, (-8.0, 1.5)), around=wall)
    alone = people(walker("anna", -4.0, -1.5, (8.0, -1.5)), around=wall)
    assert (walk(crowd, 6.0)[0]["anna"] == walk(alone, 6.0)[0]["anna"]).all()
