"""Colours and sizes of everything drawn, in one place."""

from __future__ import annotations

Colour = tuple[int, int, int]

HAND: Colour = (148, 160, 178)
PALM: Colour = (112, 124, 143)
PAD: Colour = (78, 90, 110)
OBJECT: Colour = (236, 190, 92)
SELECTED: Colour = (58, 134, 255)
PENETRATING: Colour = (220, 38, 60)
CONTACT: Colour = (30, 34, 44)
NORMAL: Colour = (110, 110, 110)
CONE_GOOD: Colour = (67, 170, 110)
CONE_BAD: Colour = (220, 38, 60)
FORCE: Colour = (214, 40, 40)
WEIGHT: Colour = (84, 84, 84)
TASK: Colour = (17, 138, 78)
PUSH: Colour = (160, 32, 100)
TORQUE: Colour = (243, 130, 40)
FORCE_ELLIPSOID: Colour = (67, 97, 238)
VELOCITY_ELLIPSOID: Colour = (150, 60, 190)
STIFFNESS_ELLIPSOID: Colour = (190, 140, 30)
REFERENCE_GHOST: Colour = (150, 90, 220)
SEED_GHOST: Colour = (90, 170, 200)
PINNED_GHOST: Colour = (0, 150, 136)

GHOST_OPACITY = 0.35
GHOST_SCALE = 0.98
"""Ghosts are a little smaller, so that they show only where they differ from the hand."""
OBJECT_OPACITY, PRINTED_OPACITY = 0.5, 0.4
"""Of the object on the page and in pictures."""
ELLIPSOID_OPACITY, CONE_OPACITY = 0.35, 0.4
CONTACT_RADIUS = 0.0035
"""Radius of a contact's dot [m]."""
NORMAL_LENGTH = 0.02
"""Length of a drawn normal [m]."""
CONE_LENGTH = 0.016
"""Height of a drawn friction cone [m]."""
TASK_LENGTH = 0.085
"""Length of the task arrow [m]."""
FORCE_SCALE_MM = 30.0
"""Length of a force arrow [mm/N]."""
GOOD_ARROW_MM = 50.0
"""Length of the largest force arrow of the grasp a page opens with [mm]."""
LONGEST_ARROW = 0.15
"""Longest arrow drawn, whatever the force [m]."""
TORQUE_SCALE = 0.2
"""Length of a torque arrow [m/(N m)]."""
