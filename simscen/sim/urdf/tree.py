"""A URDF as a tree: every link in the frame of the root, with all joints at zero."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.sim.urdf.elements import Joint, Link, MeshSource, parse_joint, parse_link
from simscen.sim.urdf.xml_source import Element, InvalidElement

MAX_LINKS = 200
"""Maximum number of links; Bullet takes 19 s to load 1000."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Links and joints by name. `poses` are those of the links in the frame of the `root` link.

    `child_joints` are the joints child_joints each link.
    """

    name: str
    root: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    poses: dict[str, Pose3]
    child_joints: dict[str, list[Joint]] = field(repr=False)
    element: Element = field(repr=False)

    def subtree(self, link: str) -> Iterator[str]:
        """Yield the names of a link and all its descendants."""
        yield link
        for joint in self.child_joints.get(link, []):
            yield from self.subtree(joint.child)


def build_tree(robot: Element, meshes: MeshSource) -> Tree:
    """Build the tree of a `<robot>`. Raises InvalidInput with all problems of its links and joints."""
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
                _add(links, parse_link(element, meshes), element)
            elif element.tag == "joint":
                _add(joints, parse_joint(element), element)
        except InvalidElement as error:
            problems.append(error.problem)
    if problems:
        raise InvalidInput(problems)
    return _join(robot, links, joints)


def _add(known: "dict[str, Link] | dict[str, Joint]", item: "Link | Joint", element: Element) -> None:
    if item.name in known:
        raise InvalidElement(element, f"two <{element.tag}>s are called {item.name!r}")
    known[item.name] = item  # type: ignore[assignment]  # callers pass a dictionary of the same type


def _join(robot: Element, links: dict[str, Link], joints: dict[str, Joint]) -> Tree:
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
        problems.append(robot.problem(f"expected one root link, found {len(roots)}: {', '.join(roots[:5])}"))
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
    return Tree(robot.name, roots[0], links, joints, poses, child_joints, robot)
