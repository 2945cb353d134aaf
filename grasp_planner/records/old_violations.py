"""Violations as files had them before: a number under a name that ended with its unit."""

from __future__ import annotations

from typing import Any

OLD_NAMES = {
    "surface_m": ("surface", "m"),
    "region_m": ("region", "m"),
    "friction_n": ("friction", "N"),
    "joint_limit_rad": ("joint_limit", "rad"),
    "compliance_rad": ("compliance", "rad"),
    "equilibrium_n": ("equilibrium_force", "N"),
    "equilibrium_nm": ("equilibrium_moment", "N m"),
    "link_object_m": ("link_object", "m"),
    "joint_centre_m": ("joint_centre", "m"),
    "self_collision_m": ("self_collision", "m"),
    "ground_m": ("ground", "m"),
    "tip_patch": ("tip_patch", "1"),
    "abduction_order_rad": ("abduction_order", "rad"),
    "load_friction_n": ("load_friction", "N"),
    "load_min_normal_n": ("load_min_normal", "N"),
    "load_max_normal_n": ("load_max_normal", "N"),
    "load_torque_nm": ("load_torque", "N m"),
    "load_force_norm_n": ("load_force_norm", "N"),
}
"""Name and unit by the old name."""


def current_violations(given: Any) -> Any:
    """Return violations in today's layout; what is not of the old one stays as it is.

    Args:
        given: What a file has under ``violations``.

    Returns:
        Records by name; requirements that were not asked for (null) are left out.
    """
    if not isinstance(given, dict) or not all(name in OLD_NAMES for name in given):
        return given
    if any(isinstance(value, dict) for value in given.values()):  # a name without a unit is the same in both
        return given
    found = {}
    for name, value in given.items():
        if value is not None:
            now, unit = OLD_NAMES[name]
            found[now] = {"value": value, "unit": unit}
    return found
