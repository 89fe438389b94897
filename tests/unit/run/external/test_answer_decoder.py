"""Tests that the answer of a stack is either decoded or refused, whatever bytes it contains."""

import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.peer import messages, wire
from simscen.peer.cdr import HEADER
from simscen.run.external.answer_decoder import Answer, decode_answer
from simscen.run.external.goal_tracker import GoalTracker
from simscen.run.external.protocol import STACK_TOPICS, ProtocolViolation
from simscen.run.external.welcome import Welcome

TIME = Clock(240)
EXAMPLES = {
    "/cmd_vel": messages.twist(1, 2, 3),
    "/plan": messages.path((1, 0), [(1, 2, 3), (4, 5, 6)]),
    "/local_plan": messages.path((1, 0), [(1, 2, 3)]),
    "/amcl_pose": messages.pose_with_covariance((1, 0), (1, 2, 3), [0] * 9),
    "/particle_cloud": messages.particle_cloud((1, 0), [(1, 2, 3, 0.5)]),
    "/tf": messages.transforms([((1, 0), "map", "odom", (1, 2, 3))]),
    "/simscen/events": messages.string('{"kind": "plan.made"}'),
    "/rosout": messages.log((1, 0), 20, "me", "a line"),
    "/plan/exact": messages.float64_array([1, 2, 3]),
    "/local_plan/exact": messages.float64_array([1, 2, 3]),
    "/amcl_pose/exact": messages.pose2d(1, 2, 3),
    "/particle_cloud/exact": messages.float64_array([1, 2, 3, 4]),
    "/tf/exact": messages.pose2d(1, 2, 3),
    "/global_costmap/costmap": messages.occupancy_grid((1, 0), "map", 0.05, 2, (1, 2, 0), [0, 100, -1, 50]),
    "/odometry/filtered": messages.odometry((1, 0), (1, 2, 3), (0.5, 0.0, 0.1), (0.1, 0.2, 0.3)),
    "/odometry/filtered/exact": messages.float64_array([240, 1, 2, 3, *[0.5] * 15]),
    "/local_costmap/costmap": messages.occupancy_grid((1, 0), "odom", 0.05, 2, (1, 2, 0), [0, 100]),
}


def decode(**answer: bytes) -> Answer:
    return decode_answer({name: [data] for name, data in answer.items()}, 240, TIME, None, Pose2(0, 0, 0))


def test_there_is_an_example_of_each_topic() -> None:
    assert EXAMPLES.keys() == {topic.name for topic in STACK_TOPICS}


@pytest.mark.sample(6)
@pytest.mark.parametrize("name", EXAMPLES)
@given(data=st.data())
def test_corrupted_bytes_are_refused_or_decoded(name: str, data) -> None:
    changed = bytearray(EXAMPLES[name])
    for _ in range(data.draw(st.integers(0, 3))):
        changed[data.draw(st.integers(0, len(changed) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(changed)))
    with_belief = {} if name == "/amcl_pose" else {"/amcl_pose": EXAMPLES["/amcl_pose"]}
    for corrupted in (bytes(changed), bytes(changed[:cut]), HEADER + data.draw(st.binary(max_size=60))):
        with suppress(ProtocolViolation):
            decode(**{name: corrupted}, **with_belief)


def test_filtered_odometry_is_recorded_unchanged() -> None:
    (odometry,) = decode(**{"/odometry/filtered": EXAMPLES["/odometry/filtered"]}).odometry
    assert odometry.pose == pytest.approx(Pose2(1, 2, 3))
    assert (odometry.tick, odometry.twist) == (240, (0.5, 0.0, 0.1))
    assert odometry.twist_variance == (0.1, 0.2, 0.3)
    (exact,) = decode(**{"/odometry/filtered/exact": EXAMPLES["/odometry/filtered/exact"]}).odometry
    assert (exact.tick, exact.pose, exact.pose_covariance) == (240, (1, 2, 3), (0.5,) * 9)


def test_without_a_transform_the_correction_follows_from_the_filtered_odometry() -> None:
    names = "/odometry/filtered", "/amcl_pose"
    belief = decode(**{name: EXAMPLES[name] for name in names}).belief
    assert belief is not None
    assert belief.map_from_odom == pytest.approx(Pose2(0.0, 0.0, 0.0))


@pytest.mark.parametrize("numbers", [[241, *[0.5] * 18], [-1, *[0.5] * 18], [240, float("nan"), *[0.5] * 17], [240, 1]])
def test_invalid_filtered_odometry_is_refused(numbers: list[float]) -> None:
    with pytest.raises(ProtocolViolation):
        decode(**{"/odometry/filtered/exact": messages.float64_array(numbers)})


def test_costmap_is_recorded_unchanged() -> None:
    (costmap,) = decode(**{"/global_costmap/costmap": EXAMPLES["/global_costmap/costmap"]}).costmaps
    assert (costmap.name, costmap.frame, costmap.grid.origin) == ("global", "map", Pose2(1, 2, 0))
    assert costmap.grid.cells.tolist() == [[0, 100], [-1, 50]]
    assert costmap.grid.resolution == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("frame", "resolution", "width", "origin"),
    [
        ("base_link", 0.05, 2, (0, 0, 0)),
        ("map", 0.0, 2, (0, 0, 0)),
        ("map", 0.05, 3, (0, 0, 0)),
        ("map", 0.05, 2, (float("nan"), 0, 0)),
    ],
)
def test_an_invalid_costmap_is_refused(frame: str, resolution: float, width: int, origin) -> None:
    message = messages.occupancy_grid((1, 0), frame, resolution, width, origin, [0, 100, -1, 50])
    with pytest.raises(ProtocolViolation, match="local costmap"):
        decode(**{"/local_costmap/costmap": message})


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(st.characters(), max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)
event_kinds = st.sampled_from(["goal.accepted", "goal.reached", "goal.failed", "goal.canceled", "plan.made"])
events = st.fixed_dictionaries(
    {"kind": event_kinds | json_values},
    optional={"name": json_values, "data": json_values, "tick": json_values},
)


@given(events)
def test_any_event_is_accepted_or_refused_and_can_be_logged(event_fields) -> None:
    from simscen.peer.messages import log, string
    from simscen.record.messages.event_text import log_text, to_json

    goals = GoalTracker(True, 240)
    with suppress(ProtocolViolation):
        for event in decode(**{"/simscen/events": messages.string(json.dumps(event_fields))}).events:
            goals.process(240, event)
    for event in goals.take_events():
        string(to_json(event))
        log((1, 0), 20, "simscen", log_text(event))
        assert json.loads(to_json(event), parse_constant=pytest.fail)


@given(st.dictionaries(st.sampled_from(["protocol", "name", "version", "topics", "step", "about"]), json_values))
def test_any_welcome_is_accepted_or_refused_and_can_be_logged(content) -> None:
    content.setdefault("protocol", 1)
    with suppress(ProtocolViolation, wire.Malformed):
        welcome = Welcome.parse(wire.WELCOME, json.dumps(content).encode(), ())
        assert all(text.encode() is not None for text in welcome.facts.values())


@given(st.binary(max_size=80))
def test_any_answer_is_decoded_or_malformed(body: bytes) -> None:
    with suppress(wire.Malformed):
        wire.from_answer(body)
    with suppress(wire.Malformed):
        wire.from_step(body)
    with suppress(wire.Malformed):
        wire.from_json(body)


@pytest.mark.parametrize(
    "event_json",
    [
        '{"kind": "plan.made", "data": {"length": NaN}}',
        '{"kind": "plan.made", "data": {"length": [-Infinity]}}',
        '{"kind": "plan.made", "data": {"length": 1e999}}',
        '{"kind": "plan.made", "name": "\\ud800"}',
        '{"kind": "goal.failed", "data": {"message": "\\udfff"}}',
        '{"kind": "plan.made", "data": {"x": ' + 900 * "[" + 900 * "]" + "}}",
        '{"kind": "plan.made", "data": {"x": "' + 5000 * "x" + '"}}',
    ],
)
def test_an_event_that_cannot_be_logged_is_refused(event_json: str) -> None:
    with pytest.raises(ProtocolViolation):
        for event in decode(**{"/simscen/events": messages.string(event_json)}).events:
            GoalTracker(True, 240).process(240, event)


@pytest.mark.parametrize(
    "welcome",
    [
        '{"protocol": 1, "name": "\\ud800"}',
        '{"protocol": 1, "about": {"x": NaN}}',
        '{"protocol": 1, "about": {"x": 1e999}}',
    ],
)
def test_a_welcome_that_cannot_be_logged_is_refused(welcome: str) -> None:
    with pytest.raises((ProtocolViolation, wire.Malformed)):
        Welcome.parse(wire.WELCOME, welcome.encode(), ())


@pytest.mark.parametrize("topic", ["/particle_cloud", "/particle_cloud/exact"])
def test_particles_that_are_not_finite_are_refused(topic: str) -> None:
    particle = (1.0, 2.0, 3.0, float("nan"))
    data = messages.float64_array(particle) if "exact" in topic else messages.particle_cloud((1, 0), [particle])
    with pytest.raises(ProtocolViolation, match="a particle on /particle_cloud that is not finite"):
        decode(**{"/amcl_pose": EXAMPLES["/amcl_pose"], topic: data})


@pytest.mark.parametrize(("stamp", "tick"), [((0, 500_000_000), 120), ((1, 0), 240), ((0, 0), 240), ((1, 1), 240)])
def test_a_plan_without_a_valid_stamp_was_made_in_this_step(stamp: tuple[int, int], tick: int) -> None:
    """Otherwise, criteria would compare the drive with another plan, or with none."""
    plan = decode(**{"/plan": messages.path(stamp, [(1, 2, 3)])}).plan
    assert plan is not None
    assert plan.tick == tick
