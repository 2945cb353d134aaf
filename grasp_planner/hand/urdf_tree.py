"""Where in a URDF the hand is: the link that its fingers branch off from, and the joints of wrist or arm before it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import defaultdict

from ..exceptions import InvalidValueError

ARM_JOINTS = 3
"""Moving joints one behind the other from which on a branch that forks is an arm, not a part of a palm."""


def joints_before_palm(robot: ET.Element) -> tuple[str, ...]:
    """Return the moving joints between the root and the palm, from the root outwards.

    Starting at the root, a single moving branch that forks farther out is followed: it is wrist or arm. Branches
    without geometry do not count, and neither do branches beside an arm.

    Args:
        robot: Root element of a URDF whose joints make one tree.

    Returns:
        Names of the joints.

    Raises:
        InvalidValueError: If there are several arms with hands.
    """
    tree = _MovingTree(robot)
    before: list[str] = []
    while True:
        branches = [joint for joint in tree.below[before[-1] if before else ""] if tree.tips[joint]]
        arms = [joint for joint in branches if tree.tips[joint] > 1 and tree.serial(joint) >= ARM_JOINTS]
        if len(arms) > 1:
            raise InvalidValueError("arms with a hand", arms, "one: cut the URDF to one hand")
        if len(branches) > 1 and not arms:
            return tuple(before)
        follow = arms or branches
        if not follow or tree.tips[follow[0]] < 2:
            return tuple(before)
        before.append(follow[0])


class _MovingTree:
    """The moving joints of a URDF: which follow which, and how many ends with geometry lie behind each.

    Attributes:
        below: Next moving joints behind each one; behind the root under an empty name.
        tips: Number of last moving joints with geometry at or behind each.
    """

    def __init__(self, robot: ET.Element) -> None:
        self.below: dict[str, list[str]] = defaultdict(list)
        self.tips: dict[str, int] = {}
        self._solid: dict[str, bool] = defaultdict(bool)
        links = {link.get("name", ""): link for link in robot.findall("link")}
        children: dict[str, list[tuple[ET.Element, str]]] = defaultdict(list)
        inner = set()
        for element in robot.findall("joint"):
            parent, child = element.find("parent"), element.find("child")
            if parent is not None and child is not None:
                children[parent.get("link", "")].append((element, child.get("link", "")))
                inner.add(child.get("link", ""))
        any_solid = any(has_geometry(link) for link in links.values())
        stack = [(name, "") for name in links if name not in inner]
        order: list[str] = []
        while stack:
            link, owner = stack.pop()
            if link in links and (has_geometry(links[link]) or not any_solid):
                self._solid[owner] = True
            for element, child_link in children[link]:
                moving = element.get("type") != "fixed"
                name = element.get("name", "") if moving else owner
                if moving:
                    self.below[owner].append(name)
                    order.append(name)
                stack.append((child_link, name))
        for name in reversed(order):
            behind = sum(self.tips[joint] for joint in self.below[name])
            self.tips[name] = behind or int(self._solid[name])

    def serial(self, joint: str) -> int:
        """Return how many moving joints follow each other from one on until a branch forks."""
        count = 1
        while len(after := [k for k in self.below[joint] if self.tips[k]]) == 1:
            joint = after[0]
            count += 1
        return count


def has_geometry(link: ET.Element) -> bool:
    """Return whether a link has a shape to be touched or seen."""
    return link.find("collision/geometry") is not None or link.find("visual/geometry") is not None
