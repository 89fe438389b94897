"""SDF elements that the importer reads or may ignore, and reports about all others."""

import difflib
from functools import lru_cache

from simscen.worlds.sdf.elements import Element
from simscen.worlds.sdf.report import ImportReport

_HARMLESS_ANYWHERE = {"plugin", "light", "pose", "name", "meta", "description", "frame", "model_state"}
HARMLESS = {
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
"""Elements that add no solid, by parent. Source: SDF specification 1.4 to 1.12, and its examples."""

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
"""Shapes and the children that are read from each of them."""

GEOMETRIC = SHAPES | {
    "world": {"model", "include", "actor", "population", "joint", "frame", "state"},
    "model": {"model", "include", "link", "joint", "frame", "pose", "static"},
    "link": {"collision", "pose", "inertial"},
    "collision": {"geometry", "pose"},
    "actor": {"link", "script", "pose"},
    "include": {"uri", "name", "pose", "static", "placement_frame"},
}
"""Elements that add or move solids, by parent: a misspelling of one of them is an error."""

_ADDS_SOLIDS = {"model", "include", "actor", "population", "link", "collision", "geometry"}
_ADDS_NO_SOLIDS = {"visual", "light", "sensor", "plugin", "particle_emitter", "projector", "audio_source", "audio_sink"}
_XACRO_DEFINITIONS = ("xacro:arg", "xacro:property", "xacro:macro")
_XACRO_CONDITIONALS = ("xacro:if", "xacro:unless")


def report_unknown(element: Element, parent: str, report: ImportReport) -> None:
    """Report an element in `parent` that the importer does not read, unless the element is known to be harmless.

    Raises UnusableElement if the unknown element could change the geometry: if it contains solids, if its parent is a
    shape, or if its name is a misspelling of an element in GEOMETRIC. Otherwise adds a note. Elements with a namespace
    prefix are ignored as extensions, which SDF allows.
    """
    tag = element.tag
    harmless = HARMLESS.get(parent, set()) | (set() if parent in SHAPES else _HARMLESS_ANYWHERE)
    if tag in harmless or tag in _XACRO_DEFINITIONS:
        return
    adds_solids = any(descendant.tag in _ADDS_SOLIDS for descendant in element.descendants())
    if tag == "experimental:params" and _changes_no_solids(element):
        return
    if tag == "experimental:params" or (tag.startswith("xacro:") and (adds_solids or tag not in _XACRO_CONDITIONALS)):
        raise element.unusable(f"<{tag[:60]}> is not expanded", "expand it first: run xacro, or `gz sdf -p`")
    if ":" in tag and not adds_solids:
        return
    similar = _most_similar_tag(tag[:60], frozenset(GEOMETRIC[parent] | harmless))
    hint = f"did you mean <{similar}>?" if similar else ""
    if adds_solids or parent in SHAPES or similar in GEOMETRIC[parent]:
        raise element.unusable(f"unknown element <{tag[:60]}>", hint)
    report.note(element.place, f"unknown element <{tag[:60]}> ignored" + (f"; {hint}" if hint else ""))


def report_unknown_children(element: Element, parent: str, report: ImportReport) -> None:
    """Report all children of an element that the importer does not read; `parent` is the key in GEOMETRIC."""
    for child in element.children:
        if child.tag not in GEOMETRIC[parent]:
            report_unknown(child, parent, report)


def _changes_no_solids(params: Element) -> bool:
    """Return whether an `<experimental:params>` changes only visuals, lights, sensors and plugins."""
    return all(
        child.tag in _ADDS_NO_SOLIDS
        or (child.tag in ("model", "link") and child.attributes.get("action") == "modify" and _changes_no_solids(child))
        for child in params.children
    )


@lru_cache(maxsize=1000)  # one comparison takes 0.3 ms, and a file repeats few different tags
def _most_similar_tag(tag: str, known: frozenset[str]) -> str:
    """Return the known tag that a misspelled tag probably means, or an empty string."""
    return next(iter(difflib.get_close_matches(tag, sorted(known), n=1, cutoff=0.75)), "")
