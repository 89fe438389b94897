"""The elements of SDF that carry no solid, and what to do with one that is not known at all."""

import difflib
from functools import lru_cache

from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import Report

_ANYWHERE = {"plugin", "light", "pose", "name", "meta", "description", "frame", "model_state"}
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
"""What may stand in each element without adding a solid. Source: SDF specification 1.4 to 1.12, and its examples."""

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
"""The shapes and what is read of each."""

MATTERS = SHAPES | {
    "world": {"model", "include", "actor", "population", "joint", "frame", "state"},
    "model": {"model", "include", "link", "joint", "frame", "pose", "static"},
    "link": {"collision", "pose", "inertial"},
    "collision": {"geometry", "pose"},
    "actor": {"link", "script", "pose"},
    "include": {"uri", "name", "pose", "static", "placement_frame"},
}
"""What adds a solid or moves one: a misspelling of these must not go unseen."""

_ADDING = {"model", "include", "actor", "population", "link", "collision", "geometry"}
_LOOKS = {"visual", "light", "sensor", "plugin", "particle_emitter", "projector", "audio_source", "audio_sink"}
_XACRO_DEFINITIONS = ("xacro:arg", "xacro:property", "xacro:macro")
_XACRO_CHOICES = ("xacro:if", "xacro:unless")


def judge_unknown(element: Element, parent: str, report: Report) -> None:
    """Report an element in `parent` that the importer does not read; known harmless ones are passed over.

    An unknown element changes the geometry if something solid stands in it, if it stands in a shape, or if its name
    is a misspelling of something that matters; otherwise it gets a note. Elements with a prefix of their own are
    extensions, as SDF allows. Raises Unusable.
    """
    tag = element.tag
    harmless = HARMLESS.get(parent, set()) | (set() if parent in SHAPES else _ANYWHERE)
    if tag in harmless or tag in _XACRO_DEFINITIONS:
        return
    adds = any(below.tag in _ADDING for below in element.descendants())
    if tag == "experimental:params" and _changes_only_looks(element):
        return
    if tag == "experimental:params" or (tag.startswith("xacro:") and (adds or tag not in _XACRO_CHOICES)):
        raise element.unusable(f"<{tag[:60]}> is not expanded", "expand it first: run xacro, or `gz sdf -p`")
    if ":" in tag and not adds:
        return
    close = _closest(tag[:60], frozenset(MATTERS[parent] | harmless))
    hint = f"did you mean <{close}>?" if close else ""
    if adds or parent in SHAPES or close in MATTERS[parent]:
        raise element.unusable(f"unknown element <{tag[:60]}>", hint)
    report.note(element.place, f"unknown element <{tag[:60]}> ignored" + (f"; {hint}" if hint else ""))


def _changes_only_looks(params: Element) -> bool:
    """Return whether an `<experimental:params>` changes nothing but visuals, lights, sensors and plugins."""
    return all(
        child.tag in _LOOKS
        or (
            child.tag in ("model", "link") and child.attributes.get("action") == "modify" and _changes_only_looks(child)
        )
        for child in params.children
    )


@lru_cache(maxsize=1000)  # a file of many elements has few kinds, and each look takes 0.3 ms
def _closest(tag: str, known: frozenset[str]) -> str:
    """The known tag that is meant by a misspelled one, or nothing."""
    return next(iter(difflib.get_close_matches(tag, sorted(known), n=1, cutoff=0.75)), "")


def judge_children(element: Element, parent: str, report: Report) -> None:
    """Report every child that the importer does not read, for an element whose children are asked for by name."""
    for child in element.children:
        if child.tag not in MATTERS[parent]:
            judge_unknown(child, parent, report)
