"""`simscen ros2 nav2` warms up what bears Nav2's names, and says what of it is missing or does not fit."""

import pytest

ACTION = ["-p", "action:=navigate_to_pose"]


def test_servers_that_become_active_with_time_are_warmed_up_and_driven_by_their_action(with_interfaces, run) -> None:
    launch = with_interfaces.node("nav2_like", *ACTION, after=1.5)
    ended = run("nav2", "--warm-up", "3", "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.said
    told = ended.about
    assert told["goals"] == "/navigate_to_pose"
    assert {"/amcl", "/bt_navigator", "/global_costmap"} <= set(told["nodes"])


@pytest.mark.parametrize(
    ("misfit", "message"),
    [
        pytest.param("planner_server", "there is no node planner_server", marks=pytest.mark.slow),
        (
            "frame",
            "amcl: base_frame_id is 'base_footprint'; simscen's base frame is 'base_link': --base-frame",
        ),
        pytest.param("", "the lifecycle node /amcl is unconfigured, not active", marks=pytest.mark.slow),
    ],
    ids=["a node", "a parameter", "a state"],
)
def test_what_of_nav2_is_missing_is_said_exactly(with_interfaces, run, misfit: str, message: str) -> None:
    launch = with_interfaces.node("nav2_like", *ACTION, after=100.0, misfit=f"'{misfit}'")
    ended = run("nav2", "--ready", "8", "--launch", launch)
    assert ended.code == 3
    assert message in ended.said
