"""The elements of SDF that carry no solid, and what to do with one that is not known at all."""

import difflib

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
}  # fmt: skip
"""What may stand in each element without adding a solid. Source: SDF specification 1.4 to 1.12, and its examples."""

SOLID = {"world": {"model", "include", "actor", "population", "joint"},
         "model": {"model", "include", "link", "joint"},
         "link": {"collision"},
         "collision": {"geometry"},
         "actor": {"link"}}  # fmt: skip
"""What may add a solid, or move one."""

_ADDING = {"model", "include", "actor", "population", "link", "collision", "geometry"}
_XACRO_DEFINITIONS = ("xacro:arg", "xacro:property", "xacro:macro")


def judge_unknown(element: Element, parent: str, report: Report) -> None:
    """Report an element in `parent` that the importer does not read; known harmless ones are passed over.

    An unknown element changes the geometry if something solid stands in it or if its name is a misspelling of
    something solid; otherwise it gets a note. Elements with a prefix of their own are extensions, as SDF allows.
    """
    tag = element.tag
    adds = any(below.tag in _ADDING for below in element.descendants())
    if tag in HARMLESS[parent] | _ANYWHERE or tag in _XACRO_DEFINITIONS:
        return
    if tag.startswith("xacro:"):
        if adds or tag not in ("xacro:if", "xacro:unless"):
            raise element.unusable(f"<{tag}> is not expanded", "run xacro on the file first")
        return
    if ":" in tag and not adds:
        return
    known = sorted(SOLID[parent] | HARMLESS[parent] | _ANYWHERE)
    close = difflib.get_close_matches(tag, known, n=1, cutoff=0.75)
    hint = f"did you mean <{close[0]}>?" if close else ""
    if adds or (close and close[0] in SOLID[parent]):
        raise element.unusable(f"unknown element <{tag}>", hint)
    report.note(element.place, f"unknown element <{tag}> ignored" + (f"; {hint}" if hint else ""))
