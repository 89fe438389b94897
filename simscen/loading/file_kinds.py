"""Recognizes the kind of a YAML file (scenario, world, robot, …) by its content."""

from simscen.core.errors import Problem
from simscen.loading.files.assets import is_ros_map, is_xml
from simscen.loading.stacks.nav2_parameters import is_nav2_parameter_file
from simscen.loading.yaml.tree import Node, entries_of

NAV2_FILE_KIND = "parameter file of Nav2"
"""Kind of the parameter files of Nav2, such as nav2_params.yaml."""
_DESCRIPTIONS = {
    "stack": "a stack file",
    NAV2_FILE_KIND: "a parameter file of Nav2",
    "map": "a ROS map",
    "world": "a world file",
    "robot": "a robot file",
    "xml": "an XML file",
}
"""Descriptions of kinds for messages."""
_STACK_FILE_KEYS = frozenset({"simscen", "name", "description", "stack"})
"""Top-level keys that a stack file can have."""
_ROBOT_KEYS = frozenset({"drive", "sensors", "limits", "body", "urdf"})
"""Top-level keys by which robot files are recognized."""
_WORLD_KEYS = frozenset({"walls", "obstacles", "objects", "doors", "places", "regions", "map_height", "sdf"})
"""Top-level keys by which world files are recognized."""
_SCENARIO_KEYS = frozenset({"world", "robot", "robots", "goals", "pass", "events", "faults", "stack"})
"""Top-level keys by which scenarios are recognized."""


def kind_of_content(tree: Node | None, text: str, display_name: str) -> str:
    """Return the kind of a file with this tree and text.

    The kind is "map" (a ROS map), "stack", NAV2_FILE_KIND, "robot", "world", "xml", or else "scenario".
    """
    if is_xml(text):
        return "xml"
    if is_ros_map(tree):
        return "map"
    if is_nav2_parameter_file(text, display_name):
        return NAV2_FILE_KIND
    keys = entries_of(tree).keys()
    if "stack" in keys and keys <= _STACK_FILE_KEYS:
        return "stack"
    if keys & _SCENARIO_KEYS:
        return "scenario"
    return "robot" if keys & _ROBOT_KEYS else "world" if keys & _WORLD_KEYS else "scenario"


def not_a_scenario_problem(kind: str, display_name: str) -> Problem:
    """Return the problem that a file of another kind (see `kind_of_content`) is used as a scenario."""
    name = display_name.rpartition("/")[2]
    option = f"run scenarios with `--stack NAME={display_name}`"
    world, robot = f"`world: {name}`", f"`robot: {{model: {name}}}`"
    hints = {
        "stack": option,
        NAV2_FILE_KIND: f"{option}, or name it in a scenario: `stack: {{nav2_params: {name}}}`",
        "robot": f"name it in a scenario: {robot}",
        "xml": f"name a world or a robot in a scenario: {world} or {robot}",
    }
    hint = hints.get(kind, f"name it in a scenario: {world}")
    return Problem(display_name, 0, 0, "SC025", f"this is {_DESCRIPTIONS[kind]}, not a scenario", hint)
