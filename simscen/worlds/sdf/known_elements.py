"""Elements of SDF that the importer knows. Harmless unknown elements are distinguished from misspelled ones."""

import difflib
from functools import lru_cache

from simscen.worlds.sdf.elements import Element
from simscen.worlds.sdf.report import ImportReport

_HARMLESS_ANYWHERE = {"plugin", "light", "pose", "name", "meta", "description", "frame", "model_state"}
"""Elements that are ignored below any parent except shapes."""
HARMLESS_CHILDREN = {
    "world": {
        "audio", "wind", "gravity", "magnetic_field", "atmosphere", "gui", "physics", "scene", "spherical_coordinates",
        "road", "state", "material", "particle_emitter", "projector",
    },
    "model": {
        "static", "self_collide", "allow_auto_disable", "enable_wind", "gripper", "sensor", "material", "link_state",
    },
    "link": {
        "gravity", "enable_wind", "self_collide", "kinematic", "must_be_base_link", "velocity_decay", "inertial",
        "visual", "sensor", "projector", "audio_sink", "audio_source", "battery", "particle_emitter", "damping",
    },
    "collision": {"laser_retro", "max_contacts", "density", "auto_inertia_params", "surface"},
    "actor": {"static", "skin", "animation", "script", "joint", "self_collide"},
    "include": {"namespace"},
    "heightmap": {"texture", "blend", "use_terrain_paging", "sampling", "use_terrain_splatting"},
    "mesh": {"convex_decomposition"},
}  # fmt: skip
"""Elements that are ignored because they add no solids, by parent. Source: SDF specification 1.4 to 1.12."""

SHAPES: dict[str, set[str]] = {
    "box": {"size"},
    "cylinder": {"radius", "length"},
    "sphere": {"radius"},
    "capsule": {"radius", "length"},
    "ellipsoid": {"radii"},
    "cone": {"radius", "length"},
    "plane": {"normal", "size"},
    "polyline": {"point", "height"},
    "heightmap": {"uri", "size", "pos"},
    "mesh": {"uri", "scale", "submesh"},
    "empty": set(),
}
"""Elements of shapes, each with the children that are read."""

GEOMETRIC_CHILDREN = SHAPES | {
    "world": {"model", "include", "actor", "population", "joint", "frame", "state"},
    "model": {"model", "include", "link", "joint", "frame", "pose", "static"},
    "link": {"collision", "pose", "inertial"},
    "collision": {"geometry", "pose"},
    "actor": {"link", "script", "pose"},
    "include": {"uri", "name", "pose", "static", "placement_frame"},
}
"""Elements that add or move solids, by parent. A misspelling of one of them is an error."""

_SOLID_TAGS = {"model", "include", "actor", "population", "link", "collision", "geometry"}
"""An unknown element adds solids if it contains one of these elements."""
_NON_SOLID_TAGS = {"visual", "light", "sensor", "plugin", "particle_emitter", "projector", "audio_source", "audio_sink"}
"""Elements that do not change solids."""
_XACRO_DEFINITIONS = ("xacro:arg", "xacro:property", "xacro:macro")
_XACRO_CONDITIONALS = ("xacro:if", "xacro:unless")


def report_unknown(element: Element, parent: str, report: ImportReport) -> None:
    """Report an element that the importer does not read. `parent` is the key of its parent in GEOMETRIC_CHILDREN.

    Harmless elements (see HARMLESS_CHILDREN) are ignored. Raises UnusableElement if the element could change the
    geometry, because

    - it contains solids,
    - its parent is a shape,
    - its name is a misspelling of an element in GEOMETRIC_CHILDREN, or
    - it is a xacro element or `experimental:params` that must be expanded first.

    Other elements with a namespace prefix are ignored. For any other element, a note is added to the report.
    """
    tag = element.tag
    harmless = HARMLESS_CHILDREN.get(parent, set()) | (set() if parent in SHAPES else _HARMLESS_ANYWHERE)
    if tag in harmless or tag in _XACRO_DEFINITIONS:
        return
    adds_solids = any(descendant.tag in _SOLID_TAGS for descendant in element.descendants())
    if tag == "experimental:params" and _changes_no_solids(element):
        return
    if tag == "experimental:params" or (tag.startswith("xacro:") and (adds_solids or tag not in _XACRO_CONDITIONALS)):
        raise element.unusable(f"<{tag[:60]}> is not expanded", "expand it first: run xacro, or `gz sdf -p`")
    if ":" in tag and not adds_solids:
        return
    similar = _most_similar_tag(tag[:60], frozenset(GEOMETRIC_CHILDREN[parent] | harmless))
    hint = f"did you mean <{similar}>?" if similar else ""
    if adds_solids or parent in SHAPES or similar in GEOMETRIC_CHILDREN[parent]:
        raise element.unusable(f"unknown element <{tag[:60]}>", hint)
    report.note(element.location, f"unknown element <{tag[:60]}> ignored" + (f"; {hint}" if hint else ""))


def report_unknown_children(element: Element, parent: str, report: ImportReport) -> None:
    """Call `report_unknown` for all children of an element that are not in GEOMETRIC_CHILDREN[parent]."""
    for child in element.children:
        if child.tag not in GEOMETRIC_CHILDREN[parent]:
            report_unknown(child, parent, report)


def _changes_no_solids(params: Element) -> bool:
    """Return whether an `<experimental:params>` changes only visuals, lights, sensors and plugins."""
    return all(
        child.tag in _NON_SOLID_TAGS
        or (child.tag in ("model", "link") and child.attributes.get("action") == "modify" and _changes_no_solids(child))
        for child in params.children
    )


@lru_cache(maxsize=1000)  # one comparison takes 0.3 ms, and a file repeats few different tags
def _most_similar_tag(tag: str, known: frozenset[str]) -> str:
    """Return the known tag that a misspelled tag probably means, or an empty string."""
    return next(iter(difflib.get_close_matches(tag, sorted(known), n=1, cutoff=0.75)), "")
