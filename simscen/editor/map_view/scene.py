"""Scene that the editor page shows for a text: objects of the scenario and of the world, and the background."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from simscen.core.errors import InvalidInput, Problem
from simscen.editor.document import EditedFile
from simscen.editor.map_view.background import Backgrounds
from simscen.editor.map_view.map_objects import Handle, Keys, MapObject, mapping
from simscen.editor.map_view.scenario_objects import scenario_objects
from simscen.editor.map_view.world_objects import world_objects, world_places
from simscen.loading.files.assets import Assets
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.validate import check
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at
from simscen.loading.yaml.tree import MappingNode, ScalarNode, child, key_position, value_position
from simscen.model.world import WorldSpec

MAX_OBJECTS = 3000
"""Maximum number of objects on a map."""


@dataclass(frozen=True)
class SceneParts:
    """The edited text, and the world that the text contains or refers to.

    Attributes:
        file: Edited file.
        text: Text in the editor.
        tree: Syntax tree of the text, including content that the text inherits from other files.
        assets: Reader of the files that the text refers to.
        world: World of the scenario, or the edited world; None if it cannot be read.
        is_inline: Whether the world is defined in the text, not in another file.
    """

    file: EditedFile
    text: str
    tree: MappingNode
    assets: Assets
    world: LoadedWorld | None
    is_inline: bool

    @property
    def world_data(self) -> dict[str, Any]:
        """Content of the world file or inline world; {} if it cannot be read."""
        if self.is_inline:
            return mapping(self.tree.plain if self.file.kind == "world" else mapping(self.tree.plain).get("world"))
        tree = None if self.world is None else self.world.tree
        return {} if tree is None else mapping(tree.plain)


def scene_parts(file: EditedFile, text: str) -> SceneParts | None:
    """Read a text, and the world that the text contains or refers to. Return None if the text is not a YAML mapping."""
    library = file.library(text)
    tree, _ = library.read(file.path, defaults=file.kind == "scenario")
    if not isinstance(tree, MappingNode):
        return None
    assets = Assets(library)
    node = child(tree, "world") if file.kind == "scenario" else tree
    world, is_inline = None, isinstance(node, MappingNode)
    try:
        if file.kind == "world":
            world = assets.world_file(file.path)
        elif isinstance(node, ScalarNode) and isinstance(node.value, str):
            world = assets.world(node)
        elif isinstance(node, MappingNode):
            spec = check(WorldSpec, node)
            world = None if isinstance(spec, list) else assets.complete_world(spec, node, file.path)
    except (InvalidInput, OSError):
        pass  # TextChecks reports the problem
    return SceneParts(file, text, tree, assets, world, is_inline)


def map_objects(parts: SceneParts) -> list[MapObject]:
    """Return at most MAX_OBJECTS objects, for the map and the list of objects."""
    places = world_places(parts.world_data)
    if parts.file.kind == "world":
        objects = list(world_objects(parts.world_data, (), places))
    else:
        objects = [*scenario_objects(parts.tree.plain, places), *world_objects(parts.world_data, ("world",), places)]
    return objects[:MAX_OBJECTS]


def scene_data(parts: SceneParts, backgrounds: Backgrounds) -> dict[str, Any]:
    """Return the objects, regions, places, background, and name of the world file as JSON data."""
    source = parse_source(parts.text)
    return {
        "kind": parts.file.kind,
        "objects": [_object_data(map_object, parts, source) for map_object in map_objects(parts)],
        "regions": {
            region.label: [[handle.x, handle.y] for handle in region.handles]
            for region in world_objects(parts.world_data, (), {})
            if region.kind == "region" and region.label
        },
        "places": sorted(world_places(parts.world_data)),
        "inline": parts.is_inline,
        "world_file": _world_file(parts),
        "background": backgrounds.background(parts.world),
    }


def _world_file(parts: SceneParts) -> str:
    """Return the name of the world file; "" for an inline world, the edited file, a ROS map, or an SDF file."""
    if parts.is_inline or parts.world is None:
        return ""
    name = parts.assets.library.sandbox.display_name(parts.world.path)
    return "" if name == parts.file.display_name or parts.world.spec is None else name


def _object_data(map_object: MapObject, parts: SceneParts, source: SourceNode | None) -> dict[str, Any]:
    is_editable, line = _editable_and_line(map_object.keys, parts, source)
    return {
        "id": "/".join(map(str, map_object.keys)) or "settings",
        "keys": list(map_object.keys),
        "kind": map_object.kind,
        "label": map_object.label,
        "handles": [_handle_data(handle) for handle in map_object.handles],
        "parts": [[[round(x, 4), round(y, 4)] for x, y in part] for part in map_object.parts],
        "line": map_object.line,
        "radius": map_object.radius,
        "radius_keys": list(map_object.radius_keys),
        "region": map_object.region,
        "follows": map_object.center_object,
        "whole": map_object.moves_as_one,
        "origin": map_object.origin,
        "points_keys": list(map_object.points_keys),
        "width": map_object.width,
        "editable": is_editable,
        "at": line,
    }


def _handle_data(handle: Handle) -> dict[str, Any]:
    return {
        "keys": list(handle.keys),
        "form": handle.notation,
        "x": round(handle.x, 6),
        "y": round(handle.y, 6),
        "yaw": None if handle.yaw is None else round(handle.yaw, 8),
        "place": handle.place,
    }


def _editable_and_line(keys: Keys, parts: SceneParts, source: SourceNode | None) -> tuple[bool, int]:
    """Return (True if the object at `keys` can be edited in this text, line of the object; 0 in another file).

    `source` is the syntax tree of the text without inherited content; None if the text is invalid.
    """
    if source is None or (not parts.is_inline and parts.file.kind == "scenario" and keys[:1] == ("world",)):
        return False, 0
    find_position = key_position if keys and isinstance(keys[-1], str) else value_position
    position = find_position(parts.tree, keys)
    is_in_text = position.path == parts.file.display_name and source_at(source, keys) is not None
    line = position.line if is_in_text and keys else 0
    if any(isinstance(key, int) for key in keys):  # an item of an inherited list cannot be changed in this text
        return is_in_text, line
    return True, line


def object_id_at_problem(problem: Problem, objects: Sequence[MapObject], source: SourceNode | None, text: str) -> str:
    """Return the ID of the object to which a problem in the text belongs; "" if there is no such object.

    If several objects contain the problem, return the object with the shortest YAML. A problem at a key belongs to the
    value in the same line. `source` is the syntax tree of `text`.
    """
    if not problem.line or source is None:
        return ""
    lines = [*text.splitlines(keepends=True), ""]
    line_start = sum(map(len, lines[: problem.line - 1]))
    index = line_start + max(problem.col - 1, 0)
    line_end = line_start + len(lines[problem.line - 1].rstrip("\r\n\x85\u2028\u2029"))
    nodes = [(node, each.keys) for each in objects if each.keys and (node := source_at(source, each.keys)) is not None]
    enclosing = [(node.end - node.start, keys) for node, keys in nodes if node.start <= index <= node.end]
    following = [(node.end - node.start, keys) for node, keys in nodes if index < node.start <= line_end]
    candidates = enclosing or following
    return "/".join(map(str, min(candidates, key=lambda candidate: candidate[0])[1])) if candidates else ""
