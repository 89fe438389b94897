"""Nav2's own system test (nav2_system_tests, test_bt_navigator): through the columns of the TurtleBot3 sandbox."""

import math

SANDBOX_BOX = "obstacles:\n    - {name: cardboard box, box: [0.5, 0.4, 0.3], pose: {x: -1.0, y: 0.6}}\n"
"""Gazebo's `cardboard_box` where Nav2 puts its unmapped obstacle."""


def sandbox_scenario(name: str, box: bool) -> str:
    """The text of the scenario; world and map are found with --world-path."""
    return f"""\
simscen: 1
name: "{name}"
world:
  simscen: 1
  name: tb3_sandbox
  sdf: worlds/tb3_sandbox.sdf.xacro
  {SANDBOX_BOX if box else ""}
map: tb3_sandbox.yaml
robot: {{model: turtlebot, pose: {{x: -2.0, y: -0.5, yaw: 0}}}}
goals:
  - {{name: goal, pose: {{x: 0.0, y: 2.0, yaw: 0}}}}
time_limit: 120 s
pass:
  - goals_reached: {{tolerance: 0.25 m, yaw_tolerance: 20 deg}}
  - collisions: {{max: 0}}
"""


# MERGED: How well the localizer knows where the robot is, in the shipped house and through the whole simulator.
START = (0.8, 4.95, 0.0)
"""The house's dock: x, y in m, yaw in rad."""
OFF, TURNED = 0.5, math.radians(20.0)
"""How wrong the told pose is, in m and rad."""

GOALS = """\
goals:
  - {pose: sofa, timeout: 120 s}
  - {pose: kitchen, timeout: 120 s}
  - {pose: study, timeout: 120 s}
"""


def tour() -> str:
    """Three rooms; told the true start with Nav2's default covariance, AMCL's default noise."""
    return f"""\
simscen: 1
name: tour of the house
world: house.world.yaml
robot: {{pose: dock}}
{GOALS}pass:
  - goals_reached: {{}}
  - localization_error: {{rmse: 5 cm, after: 5 s}}
  - collisions: {{max: 0}}
"""


def misled(direction: float, left: bool) -> str:
    """Told a pose OFF away in this direction (rad) and TURNED; must be right again before the first goal."""
    x, y = START[0] + OFF * math.cos(direction), START[1] + OFF * math.sin(direction)
    yaw = START[2] + (TURNED if left else -TURNED)
    return f"""\
simscen: 1
name: told the wrong place
world: house.world.yaml
robot:
  pose: dock
  initial_estimate: {{x: {x:.4f}, y: {y:.4f}, yaw: {yaw:.5f}}}
goals:
  - {{pose: kitchen, timeout: 120 s}}
pass:
  - goals_reached: {{}}
  - localization_error: {{final: 10 cm}}
  - collisions: {{max: 0}}
"""


FINDS_ITSELF = """\
goals:
  - {pose: kitchen, timeout: 200 s}
time_limit: 210 s
pass:
  - goals_reached: {}
  - localization_error: {final: 0.2 m}
  - collisions: {max: 0, caused_by_robot: true}
"""
"""With all defaults: it is the turning of the recoveries that shows a robot that stands where it is."""


def start_unknown() -> str:
    """The robot is told nothing of where it is, and must find out while it drives to its goal."""
    return f"""\
simscen: 1
name: start unknown
world: house.world.yaml
robot: {{pose: dock, initial_estimate: unknown}}
{FINDS_ITSELF}"""


def kidnapped() -> str:
    """After 3 m the robot is carried from the corridor into the study."""
    return f"""\
simscen: 1
name: kidnapped
world: house.world.yaml
robot: {{pose: dock}}
events:
  - {{name: kidnapped, when: {{travelled: 3 m}}, do: {{kidnap: {{pose: {{x: 9.4, y: 7.3, yaw: 90 deg}}}}}}}}
{FINDS_ITSELF}"""
