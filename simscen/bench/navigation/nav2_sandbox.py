"""Nav2's own system test (nav2_system_tests, test_bt_navigator): through the columns of the TurtleBot3 sandbox."""

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
