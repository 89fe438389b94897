"""Static links become solids, the others bodies that move as one piece.

Links that a joint connects stay rigidly connected here, whatever the joint: simscen has no jointed obstacles, and
links drawn to overlap at a joint would burst apart without it. A joint to the world, or to something static, makes
everything that hangs on it static. Links without a joint between them are bodies of their own, as in Gazebo.
"""

from dataclasses import dataclass, field, replace

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.links import LinkContent
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.placing import PlacedLink
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.tree import Model

MOST_BODIES = 2000
HEAVIEST = 1e6
"""kg: physics holds up to a thousand times more; from 1e12 on things fall through the floor."""


@dataclass
class Groups:
    """Which links hang together (union-find over their numbers); the world itself is number -1."""

    parents: dict[int, int] = field(default_factory=lambda: {-1: -1})

    def root(self, number: int) -> int:
        """The number that stands for the whole group; -1 for the group of the world."""
        self.parents.setdefault(number, number)
        while self.parents[number] != number:
            number = self.parents[number]
        return number

    def join(self, one: int, other: int) -> None:
        """Let both groups be one."""
        low, high = sorted((self.root(one), self.root(other)))
        self.parents[high] = low


def split(model: Model, pose: Pose3, contents: list[LinkContent], report: Report) -> tuple[list[Solid], list[Body]]:
    """The static solids and the bodies of one top-level model that stands at `pose`, in document order.

    A model that is one body keeps its name and its frame, as in Gazebo; several bodies have those of their first link.
    """
    groups = _groups(model, [content.link for content in contents], report)
    members: dict[int, list[LinkContent]] = {}
    for number, content in enumerate(contents):
        members.setdefault(groups.root(number), []).append(content)
    static = [solid for content in members.pop(-1, []) for solid in content.solids]
    moving = [group for group in members.values() if any(content.solids for content in group)]
    if len(moving) == 1:
        return static, [_body(model.name, pose, moving[0], report)]
    return static, [_body(group[0].link.name, group[0].link.pose, group, report) for group in moving]


def _groups(model: Model, links: list[PlacedLink], report: Report) -> Groups:
    groups = Groups()
    numbers = {id(link.frame): number for number, link in enumerate(links)}
    for number, link in enumerate(links):
        groups.root(number)
        if link.model.static:
            groups.join(-1, number)
    for owner in model.models():
        for joint in owner.joints:
            with report.skipping():
                _connect(owner, joint, numbers, groups, report)
    return groups


def _connect(owner: Model, joint: Element, numbers: dict[int, int], groups: Groups, report: Report) -> None:
    ends = []
    for tag in ("parent", "child"):
        end = joint.child(tag)
        if end is None or not end.text:
            raise joint.unusable(f"<{tag}> is missing")
        link = owner.scope.link(end.text, end)
        ends.append(-1 if link is None else numbers.get(id(link), -1))
    kind = joint.attributes.get("type", "")
    if kind != "fixed" and any(end != -1 and groups.root(end) != -1 for end in ends):
        report.note(joint.place, f"a joint of type {kind[:20] or 'unknown'} is held rigid as it stands")
    groups.join(*ends)


def _body(name: str, pose: Pose3, group: list[LinkContent], report: Report) -> Body:
    inverse = pose.inverse()
    solids = tuple(replace(s, pose=inverse.compose(s.pose)) for content in group for s in content.solids)
    mass = 0.0 if _is_kinematic(group, report) else _mass(group, report)
    return Body(name, solids, pose, mass)


def _mass(group: list[LinkContent], report: Report) -> float:
    """The mass of links that move as one; what is too heavy goes to the report and moves no more."""
    mass = sum(content.mass for content in group)
    movable = mass <= HEAVIEST
    with report.skipping():
        if not movable:
            heaviest = max(group, key=lambda content: content.mass).link.frame.element
            hint = "if nothing moves it, make its model <static>"
            raise heaviest.unusable(f"has a mass of {mass:g} kg; at most {HEAVIEST:g} kg can move", hint)
    return mass if movable else 0.0


def _is_kinematic(group: list[LinkContent], report: Report) -> bool:
    kinematic = False
    for content in group:
        element = content.link.frame.element
        with report.skipping():
            if not values.truth(element.child("gravity"), default=True):
                report.note(element.place, "gravity cannot be switched off for a single link, so it will fall")
            kinematic = kinematic or values.truth(element.child("kinematic"))
    return kinematic


def distinct(bodies: list[Body], report: Report, world: Element) -> tuple[Body, ...]:
    """The bodies with a number after every name that was taken; raises Unusable when there are too many."""
    if len(bodies) > MOST_BODIES:
        raise world.unusable(f"more than {MOST_BODIES} bodies")
    taken: set[str] = set()
    named = []
    for body in bodies:
        name, number = body.name, 0
        while name.casefold() in taken:
            number += 1
            name = f"{body.name}_{number}"
        if number:
            report.note(world.place, f"the name {body.name!r} is taken, the next one is called {name!r}")
        taken.add(name.casefold())
        named.append(replace(body, name=name))
    return tuple(named)
