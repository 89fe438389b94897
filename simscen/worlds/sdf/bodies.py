"""Group links into static solids and movable bodies.

Links that are connected by a joint of any type form one rigid body, because simscen has no jointed obstacles. A joint
to the world or to a static model makes the whole group static. Links without joints are separate bodies.
"""

from dataclasses import replace

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.sdf.elements import Element, read_bool
from simscen.worlds.sdf.link_poses import PlacedLink
from simscen.worlds.sdf.links import LinkContent
from simscen.worlds.sdf.model_tree import ModelNode
from simscen.worlds.sdf.report import ImportReport

MAX_BODIES = 2000
"""Maximum number of bodies of a world, including actors."""
MAX_MOVABLE_MASS_KG = 1e6
"""Maximum mass of a body that can move. Heavier bodies are an error."""
_WORLD = -1
"""Number that stands for the world in LinkGroups."""


class LinkGroups:
    """Disjoint sets (union-find) of links, given by numbers from 0. The links in the set of _WORLD are static."""

    def __init__(self) -> None:
        self._parents: dict[int, int] = {_WORLD: _WORLD}

    def root(self, number: int) -> int:
        """Return the smallest number in the set of a link; _WORLD if the link is static."""
        self._parents.setdefault(number, number)
        while (parent := self._parents[number]) != number:
            # Shortens the chain of parents, which long chains of joints would otherwise make slow.
            self._parents[number] = number = self._parents[parent]
        return number

    def join(self, first: int, second: int) -> None:
        """Join the sets of two links."""
        low, high = sorted((self.root(first), self.root(second)))
        self._parents[high] = low


def split_model(
    model: ModelNode, pose: Pose3, contents: list[LinkContent], report: ImportReport
) -> tuple[list[Solid], list[Body]]:
    """Return the static solids and the movable bodies of a top-level model at `pose`, in document order.

    `contents` are all links of the model and of nested models. A single movable body has the name and the frame of the
    model. If there are several movable bodies, each has the name and the frame of its first link.
    """
    groups = _link_groups(model, [content.link for content in contents], report)
    members: dict[int, list[LinkContent]] = {}
    for number, content in enumerate(contents):
        members.setdefault(groups.root(number), []).append(content)
    static = [solid for content in members.pop(_WORLD, []) for solid in content.solids]
    movable = [group for group in members.values() if any(content.solids for content in group)]
    if len(movable) == 1:
        return static, [_body(model.name, pose, movable[0], report)]
    return static, [_body(group[0].link.name, group[0].link.pose, group, report) for group in movable]


def _link_groups(model: ModelNode, links: list[PlacedLink], report: ImportReport) -> LinkGroups:
    """Return the groups of links, given by their indices in `links`. Static links are joined with _WORLD."""
    groups = LinkGroups()
    numbers = {id(link.frame): number for number, link in enumerate(links)}
    for number, link in enumerate(links):
        groups.root(number)
        if link.model.is_static:
            groups.join(_WORLD, number)
    for owner in model.models():
        for joint in owner.joints:
            with report.skip_unusable():
                _join_links(owner, joint, numbers, groups, report)
    return groups


def _join_links(
    owner: ModelNode, joint: Element, numbers: dict[int, int], groups: LinkGroups, report: ImportReport
) -> None:
    """Join the groups of the parent and the child of a joint in the model `owner`. Raises UnusableElement.

    `numbers` are the numbers of links in `groups`, by the id of their frame.
    """
    ends = []
    for tag in ("parent", "child"):
        end = joint.child(tag)
        if end is None or not end.text:
            raise joint.unusable(f"<{tag}> is missing")
        link = owner.scope.link_of_frame(end.text, end)
        ends.append(_WORLD if link is None else numbers.get(id(link), _WORLD))
    joint_type = joint.attributes.get("type", "")
    if joint_type != "fixed" and any(end != _WORLD and groups.root(end) != _WORLD for end in ends):
        report.note(joint.location, f"a joint of type {joint_type[:20] or 'unknown'} is treated as fixed")
    groups.join(*ends)


def _body(name: str, pose: Pose3, group: list[LinkContent], report: ImportReport) -> Body:
    """Return the body of a group of links, with its frame at `pose`."""
    body_from_world = pose.inverse()
    solids = tuple(replace(s, pose=body_from_world.compose(s.pose)) for content in group for s in content.solids)
    mass = 0.0 if _is_kinematic(group, report) else sum(content.mass for content in group)
    if mass > MAX_MOVABLE_MASS_KG:
        heaviest = max(group, key=lambda content: content.mass).link.frame.element
        message = f"has a mass of {mass:g} kg; at most {MAX_MOVABLE_MASS_KG:g} kg can move"
        report.add_error(heaviest.unusable(message, "if it never moves, make its model <static>"))
        mass = 0.0
    return Body(name, solids, pose, mass)


def _is_kinematic(group: list[LinkContent], report: ImportReport) -> bool:
    """Return whether any link of the group is `<kinematic>`, so that contacts do not move the body.

    Adds a note to the report for each link without gravity.
    """
    is_kinematic = False
    for content in group:
        element = content.link.frame.element
        with report.skip_unusable():
            if not read_bool(element.child("gravity"), default=True):
                report.note(element.location, "gravity cannot be switched off for a single link, so it will fall")
            is_kinematic = is_kinematic or read_bool(element.child("kinematic"))
    return is_kinematic


def with_unique_names(bodies: list[Body], report: ImportReport, world: Element) -> tuple[Body, ...]:
    """Return the bodies, with a number appended to each repeated name, and a note at the `world` element.

    Raises UnusableElement for more than MAX_BODIES.
    """
    if len(bodies) > MAX_BODIES:
        raise world.unusable(f"more than {MAX_BODIES} bodies")
    taken: set[str] = set()
    unique = []
    for body in bodies:
        name, number = body.name, 0
        while name.casefold() in taken:
            number += 1
            name = f"{body.name}_{number}"
        if number:
            report.note(world.location, f"the name {body.name!r} is already used; the next body is called {name!r}")
        taken.add(name.casefold())
        unique.append(replace(body, name=name))
    return tuple(unique)
