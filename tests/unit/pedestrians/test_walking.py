"""Tests of the social force model against closed forms and published observations."""

import math

import numpy as np
import pytest

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.pedestrians import forces
from tests.unit.pedestrians.crowds import STEP_S, corridor, make_crowd, walk, walker, walls


def test_single_pedestrian_accelerates_as_in_helbing_and_molnar():
    """v(t) = v0 (1 - exp(-t/τ)), and the distance is its integral."""
    tracks, _ = walk(make_crowd(walker("anna", 0.0, 0.0, (50.0, 0.0), speed=1.3)), 3.0)
    t, tau = np.arange(61) * STEP_S, forces.RELAXATION_TIME_S
    assert tracks["anna"][:, 0] == pytest.approx(1.3 * (t - tau * (1 - np.exp(-t / tau))), abs=1e-9)
    assert not tracks["anna"][:, 1:].any()


def test_pedestrian_stops_where_wall_force_equals_driving_force():
    """a exp(-gap/b) = v0/τ, so the gap is b ln(a τ / v0). The goal is behind the wall."""
    crowd = make_crowd(walker("anna", 0.0, 0.0, (50.0, 0.0), speed=1.3), wall_map=walls([[5.0, -9.0], [5.0, 9.0]]))
    tracks, _ = walk(crowd, 20.0)
    gap = forces.WALL_RANGE_M * math.log(forces.WALL_STRENGTH_M_S2 * forces.RELAXATION_TIME_S / 1.3)
    assert 5.0 - tracks["anna"][-1, 0] - 0.25 == pytest.approx(gap, abs=1e-3)


def test_social_force_satisfies_the_published_equations():
    """Moussaïd et al. 2009, equations 3 to 6, written out for one pair."""
    offset, relative_velocity = np.array([2.0, 0.4]), np.array([2.4, 0.1])
    distance = math.hypot(*offset)
    d = 2.0 * relative_velocity + offset / distance
    length = math.hypot(*d)
    t, b = d / length, 0.35 * length
    n = np.array([-t[1], t[0]])
    theta = math.atan2(offset @ n, offset @ t) + 0.005 * b
    f = -4.5 * math.exp(-distance / b) * (
        math.exp(-((3.0 * b * theta) ** 2)) * t + math.copysign(1, theta) * math.exp(-((2.0 * b * theta) ** 2)) * n
    )  # fmt: skip
    assert forces.social_forces(offset[None], relative_velocity[None], np.zeros(1))[0] == pytest.approx(f, rel=1e-12)


def test_head_on_pedestrians_pass_on_the_right():
    """Moussaïd et al. 2009: in a corridor 1.75 m wide, most evade to the right, and start to evade at more than 2 m."""
    crowd = make_crowd(
        walker("anna", -5.0, 0.0, (9.0, 0.0)), walker("bert", 5.0, 0.0, (-9.0, 0.0)), wall_map=corridor(1.75)
    )
    tracks, _ = walk(crowd, 10.0)
    anna, bert = tracks["anna"], tracks["bert"]
    distances = np.hypot(*(anna - bert)[:, :2].T)
    passing = int(np.argmin(np.abs(anna[:, 0] - bert[:, 0])))
    assert anna[passing, 1] < 0 < bert[passing, 1]
    assert 0.5 < bert[passing, 1] - anna[passing, 1] < 1.75 - 0.5
    at_2_m = int(np.argmax(distances < 2.0))
    assert bert[at_2_m, 1] - anna[at_2_m, 1] > 0.1
    assert distances.min() > 0.5
    assert anna[-1, 0] > 4.0 and bert[-1, 0] < -4.0


def lane_order(rows: np.ndarray, directions: np.ndarray, width: float = 0.5) -> float:
    """Return the order parameter of lane formation: 1 if each lane has one direction, near 0 without lanes.

    `rows` are the y coordinates of the pedestrians. The order is the mean of ((L - O) / (L + O))² over all pedestrians:
    in the lane of each, L pedestrians walk in the same direction, and O in the opposite direction (Rex and Löwen,
    Physical Review E 75, 2007; Nowak and Schadschneider, ibid. 85, 2012).
    """
    in_lane = np.abs(rows[:, np.newaxis] - rows) < 0.75 * width
    is_same_direction = directions[:, np.newaxis] == directions
    same_count, opposite_count = (in_lane & is_same_direction).sum(axis=1), (in_lane & ~is_same_direction).sum(axis=1)
    return float((((same_count - opposite_count) / (same_count + opposite_count)) ** 2).mean())


def counterflow_order(seed: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return the lane order in the middle of a corridor in which two crowds walk through each other.

    The second number is the order of the same positions with shuffled directions.
    """
    crowd_rng = np.random.default_rng(seed)
    crowd = make_crowd(wall_map=corridor(5.0))
    for index in range(32):
        direction = 1.0 if index % 2 else -1.0
        x, y = -direction * (3.0 + 1.2 * (index // 2)), crowd_rng.uniform(-2.1, 2.1)
        crowd.add(walker(f"p{index:02}", x, y, (90.0 * direction, y), speed=float(crowd_rng.normal(1.29, 0.19))))
    tracks, _ = walk(crowd, 13.0)
    poses = np.stack(list(tracks.values()))
    directions = np.where(np.arange(32) % 2, 1.0, -1.0)
    orders, shuffled = [], []
    for step in range(160, 261, 20):
        in_the_middle = np.abs(poses[:, step, 0]) < 7.0
        rows, row_directions = poses[in_the_middle, step, 1], directions[in_the_middle]
        orders.append(lane_order(rows, row_directions))
        shuffled += [lane_order(rows, rng.permutation(row_directions)) for _ in range(20)]
    return float(np.mean(orders)), float(np.mean(shuffled))


@pytest.mark.slow
def test_lanes_form_where_two_crowds_walk_through_each_other():
    """The lane order is above that of shuffled directions for each seed, and more than twice as high on average."""
    rng = np.random.default_rng(1)
    orders = np.array([counterflow_order(seed, rng) for seed in range(3)])
    assert (orders[:, 0] > orders[:, 1]).all(), orders
    assert orders[:, 0].mean() > 2 * orders[:, 1].mean(), orders


def test_group_members_walk_side_by_side():
    """Members stay within (N - 1)/2 m of the center of the group; pedestrians without a group drift apart."""

    def spread(group: str | None) -> np.ndarray:
        goal = (40.0, 0.0)
        crowd = make_crowd(
            *(walker(f"p{k}", 0.0, 1.5 * k - 1.5, goal, speed=1.0 + 0.2 * k, group=group) for k in range(3))
        )
        tracks, _ = walk(crowd, 15.0)
        ends = np.array([track[-1, :2] for track in tracks.values()])
        return np.hypot(*(ends - ends.mean(axis=0)).T)

    assert spread("friends").max() < 1.4
    assert spread(None).max() > 2.5


def test_pedestrians_do_not_walk_through_walls_or_each_other():
    """Fifty pedestrians in a hurry pass through one door."""
    rng = np.random.default_rng(5)
    outer_walls = [[[0, 0], [8, 0]], [[8, 0], [8, 8]], [[8, 8], [0, 8]], [[0, 8], [0, 0]]]
    crowd = make_crowd(wall_map=walls(*outer_walls, [[0, 4], [3.4, 4]], [[4.6, 4], [8, 4]]))
    starts = [(x, y) for x in np.arange(0.5, 7.6, 0.7) for y in np.arange(0.5, 3.6, 0.7)][:50]
    for index, (x, y) in enumerate(starts):
        crowd.add(walker(f"p{index:02}", x, y, (float(rng.uniform(3.9, 4.1)), 7.7), speed=2.0))
    tracks, _ = walk(crowd, 8.0)
    positions = np.stack([track[:, :2] for track in tracks.values()], axis=1)
    distances = np.hypot(*np.moveaxis(positions[:, :, None] - positions[:, None], 3, 0)) + 9 * np.eye(len(starts))
    assert distances.min() >= 0.5 - 1e-9
    assert positions.min() >= 0.25 - 1e-9 and positions.max() <= 7.75 + 1e-9
    wall_distance = np.abs(positions[..., 1] - 4.0)
    assert (wall_distance[np.abs(positions[..., 0] - 4.0) > 0.6] >= 0.25 - 1e-9).all()
    assert (positions[-1, :, 1] > 4.0).sum() >= 5


def test_goals_are_visited_once_in_a_loop_or_back_and_forth():
    def reached(repeat: str) -> list[str]:
        crowd = make_crowd(walker("anna", 0.0, 0.0, (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), repeat=repeat))
        return [event.goal_or_robot for event in walk(crowd, 20.0)[1]]

    assert reached("once") == ["1", "2", "3"]
    assert reached("loop")[:7] == ["1", "2", "3", "1", "2", "3", "1"]
    assert reached("back_and_forth")[:7] == ["1", "2", "3", "2", "1", "2", "3"]


def test_pedestrian_stays_at_the_last_goal():
    tracks, events = walk(make_crowd(walker("anna", 0.0, 0.0, (3.0, 0.0))), 12.0)
    assert [event.kind for event in events] == ["reached"]
    assert tracks["anna"][-1, :2] == pytest.approx([3.0, 0.0], abs=0.06)
    assert tracks["anna"][-1, 0] == tracks["anna"][-20, 0]


def test_equal_pedestrians_walk_bit_identical_paths():
    def run() -> bytes:
        crowd = make_crowd(*(walker(f"p{k}", 2.0 * k, k % 3 - 1.0, (20.0 - 2 * k, 0.0)) for k in range(8)))
        return b"".join(track.tobytes() for track in walk(crowd, 10.0)[0].values())

    assert run() == run()


@pytest.mark.parametrize("name", ["a first", "m between", "z last"])
def test_additional_pedestrian_changes_others_only_after_meeting(name):
    def run(*additional: WalkingPedestrian) -> np.ndarray:
        crowd = make_crowd(*(walker(f"m{k}", 1.1 * k, k % 3 - 1.0, (9.0 - k, 0.0), group="g" if k > 4 else None)
                         for k in range(8)), *additional, wall_map=corridor(8.0))  # fmt: skip
        tracks, _ = walk(crowd, 6.0)
        return np.stack([track for name, track in tracks.items() if name.startswith("m") and name != "m between"])

    assert (run() == run(walker(name, 40.0, 0.0, (60.0, 0.0)))).all()
    assert not (run() == run(walker(name, 12.0, 0.5, (0.0, 0.5)))).all()


def test_walls_hide_people_from_each_other():
    """Two pedestrians on both sides of a wall walk straight past each other."""
    wall = walls([[-9.0, 0.0], [9.0, 0.0]])
    crowd = make_crowd(walker("anna", -4.0, -1.5, (8.0, -1.5)), walker("bert", 4.0, 1.5, (-8.0, 1.5)), wall_map=wall)
    alone = make_crowd(walker("anna", -4.0, -1.5, (8.0, -1.5)), wall_map=wall)
    assert (walk(crowd, 6.0)[0]["anna"] == walk(alone, 6.0)[0]["anna"]).all()
