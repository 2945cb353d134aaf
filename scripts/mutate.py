"""Change central lines of a copy of the package, one by one, and see that a test fails each time.

Run by hand: ``python scripts/mutate.py [words of the lines to try]``. The work tree stays as it is. Exit code 1 if
fewer than 28 of 30 changes are noticed, in proportion.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ENOUGH = 28 / 30
"""Share of the changes that tests have to notice."""
JUDGE = ("tests/test_judge.py", "tests/test_judge_loads.py", "tests/test_judge_clearance.py")


@dataclass(frozen=True)
class Mutation:
    """A line changed as a slip would change it.

    Attributes:
        file: File of the package.
        old: Text that is replaced; it occurs once.
        new: What replaces it.
        tests: Test files that should notice.
    """

    file: str
    old: str
    new: str
    tests: tuple[str, ...] = JUDGE


MUTATIONS = (
    Mutation("terms/posture.py", "np.maximum(hand.lower - q, q - hand.upper)", "np.maximum(q - hand.upper, 0.0)"),
    Mutation("terms/posture.py", "np.maximum(hand.lower - q, q - hand.upper)", "np.maximum(hand.lower - q, 0.0)"),
    Mutation("terms/posture.py", "reference_joint_angles + yielded", "reference_joint_angles - yielded"),
    Mutation("terms/posture.py", "-(grasp.problem.abduction_differences", "(grasp.problem.abduction_differences"),
    Mutation("terms/equilibrium.py", "_imbalance(grasp)[:3]", "_imbalance(grasp)[:2]"),
    Mutation("terms/equilibrium.py", "_imbalance(grasp)[3:]", "_imbalance(grasp)[4:]"),
    Mutation("terms/contact.py", "np.abs(grasp.contacts.gaps).max()", "np.maximum(grasp.contacts.gaps, 0.0).max()"),
    Mutation("terms/contact.py", "-margins.min(initial=0.0)", "-margins.max(initial=0.0)"),
    Mutation("terms/friction.py", "grasp.friction_margins.min()", "grasp.friction_margins.max()"),
    Mutation("terms/loads.py", "-grasp.load_check.friction)", "-grasp.load_check.friction - 1.0)"),
    Mutation("terms/loads.py", "grasp.load_check.largest_normal - ", "grasp.load_check.least_normal - "),
    Mutation("terms/clearance.py", 'return penetration(grasp.near_clearances, "self_collision")', "return 0.0"),
    Mutation(
        "grasp/grasp.py",
        "for found in self.violations.values()) and self.force_closed",
        "for found in self.violations.values())",
    ),
    Mutation("grasp/grasp.py", "if not found.value <= tolerance", "if found.value > tolerance"),
    Mutation(
        "judge/clearance_check.py",
        "above_zero(-problem.grasp_object.solid.sample",
        "above_zero(problem.grasp_object.solid.sample",
    ),
    Mutation("judge/clearance_check.py", "-float(normal @ axis)", "float(normal @ axis)"),
    Mutation("judge/clearance_check.py", "placed.centres - high), 0.0)", "high - placed.centres), 0.0)"),
    Mutation("judge/clearance_check.py", "None if value > self.near", "None if value > self.near - 1e-3"),
    Mutation("hand/solids.py", "joints[i] != joints[j] and frozenset", "frozenset"),
    Mutation("hand/solids.py", "frozenset((links[i], links[j])) not in free", "True"),
    Mutation("judge/clearance_check.py", "pair.kind == kind and not pair.exempt", "pair.kind == kind"),
    Mutation("judge/load_check.py", "problem.friction / loads.friction_safety", "problem.friction"),
    Mutation("judge/load_check.py", "np.maximum(high, -low) - problem.torque_limits", "high - problem.torque_limits"),
    Mutation("judge/load_check.py", "nominal - swing), np.maximum", "nominal), np.maximum"),
    Mutation("problem/load_cases.py", "max(self.force, self.acceleration * mass)", "self.force"),
    Mutation("problem/load_cases.py", "max(self.force, self.acceleration * mass)", "self.acceleration * mass"),
    Mutation(
        "problem/problem.py",
        "self.grasp_object.mass * self.parameters.gravity",
        "-self.grasp_object.mass * self.parameters.gravity",
    ),
    Mutation(
        "problem/problem.py", "return limits if self.loads.hand_limits", "return 2.0 * limits if self.loads.hand_limits"
    ),
    Mutation("problem/problem.py", "-= order.sign", "+= order.sign", (*JUDGE, "tests/test_clearance.py")),
    Mutation(
        "model/compliance.py",
        "np.diag(c_s) + softened(jacobian, joint)",
        "softened(jacobian, joint)",
        (*JUDGE, "tests/test_compliance.py"),
    ),
    Mutation(
        "model/compliance.py",
        "1.0 / np.asarray(contact",
        "2.0 / np.asarray(contact",
        (*JUDGE, "tests/test_compliance.py"),
    ),
    Mutation(
        "model/compliance.py",
        "projector @ (stiffness + k_c)",
        "projector @ (stiffness)",
        (*JUDGE, "tests/test_compliance.py"),
    ),
    Mutation("model/contacts.py", "centres + radii[:, None] * normals", "centres", (*JUDGE, "tests/test_contacts.py")),
    Mutation(
        "model/friction.py",
        "np.asarray(friction) * normal - np.linalg",
        "normal - np.linalg",
        (*JUDGE, "tests/test_force_closure.py"),
    ),
    Mutation(
        "model/force_closure.py",
        "return float(found[-1]), -np.outer",
        "return 1.0, -np.outer",
        (*JUDGE, "tests/test_force_closure.py"),
    ),
    Mutation(
        "model/force_closure.py",
        "rows.T @ (rows @ found.ravel())",
        "0.0 * found.ravel()",
        ("tests/test_force_closure.py",),
    ),
    Mutation(
        "model/force_closure.py",
        "(coefficients * normal - length > SHOWN",
        "(normal - length > SHOWN",
        ("tests/test_force_closure.py",),
    ),
    Mutation(
        "objects/normal_spread.py", "sides != 0), sides", "sides != 9), sides", ("tests/objects/test_triangles.py",)
    ),
    Mutation("objects/normal_spread.py", "near.owners[:, None] * len", "0 * len", ("tests/objects/test_triangles.py",)),
    Mutation(
        "objects/normal_spread.py",
        "found.distance <= radius",
        "found.distance < 9.0",
        ("tests/objects/test_triangles.py",),
    ),
    Mutation(
        "objects/triangles.py",
        "np.where(self._inside(points, distance), -1.0",
        "np.where(False, -1.0",
        ("tests/objects/test_triangles.py",),
    ),
    Mutation(
        "judge/stability.py", "return by_q + self.preload, by_nu", "return by_q, by_nu", ("tests/test_stability.py",)
    ),
)


def applied(mutation: Mutation, package: Path) -> str:
    """Return the text of a mutation's file with the line changed.

    Raises:
        ValueError: If the old text does not occur exactly once.
    """
    text = (package / mutation.file).read_text(encoding="utf-8")
    if text.count(mutation.old) != 1:
        raise ValueError(f"{mutation.file}: {mutation.old!r} occurs {text.count(mutation.old)} times")
    return text.replace(mutation.old, mutation.new)


def noticed(mutation: Mutation, copy: Path) -> bool:
    """Return whether the tests notice a mutation, made in a copy of package and tests and taken back."""
    target = copy / "grasp_planner" / mutation.file
    original = target.read_text(encoding="utf-8")
    target.write_text(applied(mutation, copy / "grasp_planner"), encoding="utf-8")
    try:
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *mutation.tests]
        environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, check=False)
        return done.returncode == 1
    finally:
        target.write_text(original, encoding="utf-8")


def main(words: list[str]) -> int:
    """Try the mutations whose file or text has all of the words."""
    chosen = [m for m in MUTATIONS if all(word in f"{m.file} {m.old}" for word in words)]
    found = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for name in ("grasp_planner", "tests", "urdf"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", copy)
        for mutation in chosen:
            seen = noticed(mutation, copy)
            found += seen
            verdict = "noticed " if seen else "SURVIVED"
            sys.stdout.write(f"{verdict} {mutation.file}: {mutation.old} → {mutation.new}\n")
            sys.stdout.flush()
    sys.stdout.write(f"{found} of {len(chosen)} noticed\n")
    return 0 if found >= ENOUGH * len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
