"""Connects the links and joints of a URDF to a tree."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeVar

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.sim.urdf.elements import Joint, Link, MeshSource, parse_joint, parse_link
from simscen.sim.urdf.xml_source import Element, InvalidElement

Item = TypeVar("Item", Link, Joint)
MAX_LINKS = 200
"""Maximum number of links."""


@dataclass(frozen=True, eq=False)
class LinkTree:
    """Links and joints of a URDF by name. `element` is the `<robot>`.

    root:          name of the root link
    poses:         poses of all links in the frame of the root link, by name, with all joints at zero
    child_joints:  joints to the child links of each link, by the name of the parent link
    """

    name: str
    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    poses: dict[str, Pose3]
    child_joints: dict[str, list[Joint]] = field(repr=False)
    element: Element = field(repr=False)

    def subtree(self, link: str) -> Iterator[str]:
        """Yield the name of a link and the names of all links below it."""
        yield link
        for joint in self.child_joints.get(link, []):
            yield from self.subtree(joint.child)


def build_tree(robot: Element, meshes: MeshSource) -> LinkTree:
    """Build the tree of a `<robot>` element. Raises InvalidInput with all problems of its links and joints."""
    if robot.tag != "robot":
        raise InvalidInput([robot.problem(f"expected <robot>, got <{robot.tag}>")])
    if sum(1 for _ in robot.all("link")) > MAX_LINKS:
        raise InvalidInput([robot.problem(f"more than {MAX_LINKS} links")])
    problems: list[Problem] = []
    links: dict[str, Link] = {}
    joints: dict[str, Joint] = {}
    for element in robot.children:
        try:
            if element.tag == "link":
                _add_unique(links, parse_link(element, meshes))
            elif element.tag == "joint":
                _add_unique(joints, parse_joint(element))
        except InvalidElement as error:
            problems.append(error.problem)
    if problems:
        raise InvalidInput(problems)
    return _connect_links(robot, links, joints)


def _add_unique(known: dict[str, Item], item: Item) -> None:
    """Add a link or joint by name; raises InvalidElement if the name is not unique."""
    if item.name in known:
        raise InvalidElement(item.element, f"two <{item.element.tag}>s are called {item.name!r}")
    known[item.name] = item


def _connect_links(robot: Element, links: dict[str, Link], joints: dict[str, Joint]) -> LinkTree:
    """Return the tree of links that the joints connect. Raises InvalidInput unless there is exactly one root link."""
    problems = []
    parents: dict[str, Joint] = {}
    child_joints: dict[str, list[Joint]] = {}
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in links:
                problems.append(
                    joint.element.problem(f"joint {joint.name!r} names a link {link!r} that does not exist")
                )
        if joint.child in parents:
            problems.append(joint.element.problem(f"link {joint.child!r} is the child of two joints"))
        parents[joint.child] = joint
        child_joints.setdefault(joint.parent, []).append(joint)
    roots = [name for name in links if name not in parents]
    if len(roots) != 1 and not problems:
        without_root = "a loop of joints" if links else "no <link>"
        found = f"{len(roots)}: {', '.join(roots[:5])}" if roots else without_root
        problems.append(robot.problem(f"expected one root link, found {found}"))
    if problems:
        raise InvalidInput(problems)
    poses = {roots[0]: Pose3()}
    waiting = [roots[0]]
    while waiting:
        link = waiting.pop()
        for joint in child_joints.get(link, []):
            poses[joint.child] = poses[link].compose(joint.pose)
            waiting.append(joint.child)
    if len(poses) < len(links):
        unreachable = next(name for name in links if name not in poses)
        raise InvalidInput([links[unreachable].element.problem(f"link {unreachable!r} is part of a loop of joints")])
    return LinkTree(robot.name, roots[0], links, joints, poses, child_joints, robot)
