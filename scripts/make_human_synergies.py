"""Make the human synergy sets of the DLR/HIT II: human postures, retargeted by fingertips, then PCA.

Human joint angles are drawn from published means and covariances, a human hand turns them into fingertips, inverse
kinematics finds robot postures that do the same, and their principal components are the synergies. The constants
are explained where they stand and in urdf/dlr_hit_ii/synergies/human/README.md.

Usage: python scripts/make_human_synergies.py [--check]
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

import grasp_planner as gp
from grasp_planner.hand.kinematics import HandKinematics
from grasp_planner.spatial import Array
from grasp_planner.synergies.human_hand import HUMAN_JOINTS, HumanHand, human_fingertips, thumb_from_carpometacarpal
from grasp_planner.synergies.retargeting import FingerCorrespondence, RetargetingWeights, retarget_postures
from grasp_planner.synergies.space import save_synergies, synergies_from_postures

FOLDER = Path(__file__).parents[1] / "urdf" / "dlr_hit_ii" / "synergies"
SEED = 0
POSTURES = 600
FINGERS = ("index", "middle", "ring", "little")

# Abduction of the fingers: mean separations of GraspIt!'s human hand; the robot has +-15 deg where people have
# about +-30, so that deviations are halved.
MEAN_ABDUCTION = np.radians([7.5, 10.1, 7.7])
ABDUCTION_GAIN = 0.5
# Human joint ranges [deg]: thumb (rotation, MCP, IP, abduction), three abductions, four MCP, four PIP.
HUMAN_RANGE = np.radians(
    [[-180, -20, -20, 0, *[-5] * 3, *[-15] * 4, *[-5] * 4], [180, 75, 85, 120, *[35] * 3, *[90] * 4, *[110] * 4]]
)
# Robot: distance to the joint limits left for the springs [deg] (abd, mcp, pip).
LIMIT_MARGIN = np.radians([1.0, 5.0, 5.0])
REST_FLEXION = (25.0, 35.0)  # of the four fingers, MCP and PIP [deg]


@dataclass(frozen=True)
class Mapping:
    """How the human thumb is put, and how a posture is carried over.

    Attributes:
        suffix: Ending of the file's name.
        thumb_rest: Mean rotation and abduction of the thumb [deg]. The zeros of the gloves' thumb angles are not
            published, so that their means say nothing; here the thumb opposes the fingers in the mean.
        hand: The human hand, with the thumb's base and pronation.
        opposed: Largest distance of the thumb from index and middle finger [m], and smallest cosine between their
            pulps and the way across, of the postures kept; None keeps all.
        finger_scale: Scale of the fingers' own vectors; None takes the ratio of finger lengths, finger by finger.
        opposition_scale: Scale of the thumb's vectors to the other tips.
        tilt: Angle by which these are turned about y [deg]; None leaves it free.
        weights: What counts how much.
        rest_thumb: Thumb of the robot's rest posture [deg].
        rest_abduction: The fingers' abduction there [deg].
        note: The choice in words.
    """

    suffix: str
    thumb_rest: tuple[float, float]
    hand: HumanHand
    opposed: tuple[float, float] | None
    finger_scale: float | None
    opposition_scale: float
    tilt: float | None
    weights: RetargetingWeights
    rest_thumb: tuple[float, float, float]
    rest_abduction: tuple[float, float, float, float]
    note: str


CONTACTS, CLEAR = (
    Mapping(
        suffix="",
        thumb_rest=(95.0, 55.0),
        hand=HumanHand(thumb_base_depth=0.06, thumb_pronation=np.radians(18.0)),
        opposed=(0.13, 0.3),
        finger_scale=None,
        opposition_scale=1.1,
        tilt=None,
        weights=RetargetingWeights(1.0, (1.5, 1.5, 0.75, 0.75), rest=0.5),
        rest_thumb=(-8.0, 20.0, 45.0),
        rest_abduction=(0.0, 0.0, 0.0, 0.0),
        note=(
            "kept: postures whose pulps face each other (cosine > 0.3), at most 130 mm apart; retargeted: finger\n"
            "vectors by finger length, lengths and sideways offsets of the thumb's vectors to the other tips x 1.1\n"
            "contacts only: the thumb comes from below the fingertips and folds up to its limit; around a cylinder\n"
            "it passes through the object. Where links have to keep clear take santello_clear"
        ),
    ),
    Mapping(
        suffix="_clear",
        thumb_rest=(98.0, 49.0),
        hand=HumanHand(thumb_base_depth=0.0, thumb_pronation=np.radians(20.0)),
        opposed=None,
        finger_scale=1.13,
        opposition_scale=1.13,
        tilt=-30.0,
        weights=RetargetingWeights(1.0, (1.75, 1.75, 0.2, 0.2), rest=(0.5,) * 3 + (4.0, 0.5, 0.5) * 4),
        rest_thumb=(-10.0, 15.0, 40.0),
        rest_abduction=(-7.5, -2.5, 2.5, 7.5),
        note=(
            "retargeted: fingers' own vectors and the thumb's vectors to the other tips x 1.13, the latter turned by\n"
            "-30 deg about y, because the robot's thumb stands in front of the palm; it closes from there with the\n"
            "fingers, the object between them; the fingers' abduction is drawn to a fan of\n"
            "-7.5 .. 7.5 deg, so that they keep their order"
        ),
    ),
)


@dataclass(frozen=True)
class Source:
    """A published distribution of human postures.

    Attributes:
        name: Name of the set.
        sample: Draws N human postures [rad] about a mean thumb rotation and abduction [rad], (N, 15) in the order
            of HUMAN_JOINTS.
        provenance: Where it comes from.
    """

    name: str
    sample: Callable[[np.random.Generator, int, tuple[float, float]], Array]
    provenance: str


def read_table(name: str) -> tuple[list[str], dict[str, list[float]]]:
    """Return column names and rows by name of a file of human statistics; empty cells are left out."""
    text = (FOLDER / "human" / f"{name}.csv").read_text(encoding="utf-8")
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    return rows[0][1:], {row[0]: [float(cell) for cell in row[1:] if cell] for row in rows[1:]}


def santello_statistics() -> tuple[Array, Array]:
    """Return mean [rad] and covariance [rad²] of Santello's postures; the scale is the replication's."""
    _, rows = read_table("santello1998")
    table = np.array([rows[joint] for joint in HUMAN_JOINTS])
    shares = np.array(rows["share_percent"])
    # The paper gives the first four shares; the rest is divided so that each is half of the one before.
    others = 0.5 ** np.arange(table.shape[1] - 1 - len(shares))
    shares = np.concatenate([shares, (100.0 - shares.sum()) * others / others.sum()])
    _, replication = read_table("replication2021")
    total = sum(np.radians(1.0) ** 2 * replication[joint][1 + k] for k, joint in enumerate(HUMAN_JOINTS))
    return np.radians(table[:, 0]), table[:, 1:] @ np.diag(shares / 100.0 * total) @ table[:, 1:].T


def sample_santello(rng: np.random.Generator, number: int, thumb: tuple[float, float]) -> Array:
    """Draw human postures from Santello's mean and synergies, of shape (number, 15)."""
    mean, covariance = santello_statistics()
    mean[[0, 3]] = thumb
    mean[4:7] = MEAN_ABDUCTION
    return _bounded(_normal(rng, mean, covariance, number))


def sample_uji(rng: np.random.Generator, number: int, thumb: tuple[float, float]) -> Array:
    """Draw human postures from the UJI covariance about Santello's mean, of shape (number, 15)."""
    columns, rows = read_table("uji2019")
    covariance = np.array([rows[joint] for joint in columns]) * np.radians(1.0) ** 2
    mean, _ = santello_statistics()
    mean[[0, 3]] = 0.0
    mean[4:7] = MEAN_ABDUCTION
    angles = _normal(rng, mean, covariance, number)
    angles[:, 0], angles[:, 3] = thumb_from_carpometacarpal(thumb, angles[:, 0], angles[:, 3])
    return _bounded(angles)


def _normal(rng: np.random.Generator, mean: Array, covariance: Array, number: int) -> Array:
    """Draw from a normal distribution; Cholesky's factor is unique, unlike eigenvectors."""
    return mean + rng.standard_normal((number, len(mean))) @ np.linalg.cholesky(covariance).T


def _bounded(angles: Array) -> Array:
    """Apply the abduction gain and the joint ranges."""
    angles[:, 4:7] = MEAN_ABDUCTION + ABDUCTION_GAIN * (angles[:, 4:7] - MEAN_ABDUCTION)
    return np.clip(angles, *HUMAN_RANGE)


SOURCES = (
    Source(
        "santello",
        sample_santello,
        "human postures: mean and 15 synergies of Santello et al. 1998 (J. Neurosci. 18(23):10105; 5 people,\n"
        "57 imagined objects) as shipped with SynGrasp (Malvezzi et al. 2015; thumb rows unlabelled there,\n"
        "assignment inferred); variances: Table 2 of the paper for the first four, the rest halving from one to\n"
        "the next; their total: that of a replication of 2021",
    ),
    Source(
        "uji",
        sample_uji,
        "human postures: covariance of KINE-ADL BE-UJI (Roda-Sales et al. 2019, doi 10.1038/s41597-019-0175-6;\n"
        "25 people, 3560 static grasps), rebuilt from published per-session PCAs (column order inferred), about\n"
        "the mean posture of Santello et al. 1998, because no mean is published",
    ),
)
SETS = ((SOURCES[0], CONTACTS), (SOURCES[1], CONTACTS), (SOURCES[0], CLEAR))
HOW = """\
thumb: the gloves' zeros are unknown; mean rotation {mapping.thumb_rest[0]:.0f} deg, abduction
{mapping.thumb_rest[1]:.0f} deg and pronation {pronation:.0f} deg are chosen so that it opposes index and middle finger
and, among such values, with a view to what one to three synergies can hold (a cylinder of 6 cm)
{mapping.note}
mean errors {finger:.1f} mm (fingertips), {thumb:.1f} mm (thumb to index and middle)
made by scripts/make_human_synergies.py: {number} postures, seed {seed}; PCA, orthonormal"""


def human_postures(source: Source, mapping: Mapping) -> Array:
    """Return human fingertips of random postures [m], of shape (POSTURES, 5, 3)."""
    rng = np.random.default_rng(SEED)
    thumb = (float(np.radians(mapping.thumb_rest[0])), float(np.radians(mapping.thumb_rest[1])))
    kept: list[Array] = []
    while sum(map(len, kept)) < POSTURES:
        tips = human_fingertips(mapping.hand, source.sample(rng, POSTURES, thumb))
        if mapping.opposed is None:
            return tips.position
        aperture, cosine = tips.opposition()
        largest, smallest = mapping.opposed
        kept.append(tips.position[(aperture < largest) & (cosine > smallest)])
    return np.concatenate(kept)[:POSTURES]


def correspondence(mapping: Mapping, hand: gp.Hand, kinematics: HandKinematics) -> FingerCorrespondence:
    """Return how the human hand is laid over the robot's, by the MCP joints."""
    data, straight = hand.model.createData(), np.zeros(hand.n_joints)
    pin.forwardKinematics(hand.model, data, hand.full_configuration(straight))
    joints = [hand.model.getJointId(f"{finger}_mcp") for finger in FINGERS]
    palm = hand.palm_in_root.inverse()
    bases = np.array([palm.act(data.oMi[joint].translation) for joint in joints])
    lengths = np.linalg.norm(kinematics.compute(straight).position[1:] - bases, axis=1)
    scale = lengths / mapping.hand.finger_lengths
    if mapping.finger_scale is not None:
        scale = np.full(len(FINGERS), mapping.finger_scale)
    tilt = None if mapping.tilt is None else float(np.radians(mapping.tilt))
    return FingerCorrespondence(mapping.hand.finger_bases, bases, scale, mapping.opposition_scale, tilt)


def rest_posture(mapping: Mapping) -> Array:
    """Return the robot's rest posture [rad], of shape (15,)."""
    fingers = [(abduction, *REST_FLEXION) for abduction in mapping.rest_abduction]
    return np.radians([*mapping.rest_thumb, *itertools.chain.from_iterable(fingers)])


def make(source: Source, mapping: Mapping, hand: gp.Hand) -> gp.SynergySpace:
    """Return the robot synergies of one source."""
    kinematics = HandKinematics(hand, hand.contact_frames("point"))

    def fingertips(q: Array) -> tuple[Array, Array]:
        result = kinematics.compute(q)
        return result.position, result.linear

    margin = np.tile(LIMIT_MARGIN, hand.n_joints // 3)
    found = retarget_postures(
        fingertips,
        (hand.lower + margin, hand.upper - margin),
        human_postures(source, mapping),
        correspondence(mapping, hand, kinematics),
        rest_posture(mapping),
        mapping.weights,
    )
    how = HOW.format(
        mapping=mapping,
        pronation=np.degrees(mapping.hand.thumb_pronation),
        finger=1e3 * found.finger_errors.mean(),
        thumb=1e3 * np.abs(found.opposition_errors[:, :2]).mean(),
        number=POSTURES,
        seed=SEED,
    )
    name, provenance = source.name + mapping.suffix, f"{source.provenance}\n{how}"
    return synergies_from_postures(hand.joint_names, found.joint_angles, name=name, provenance=provenance)


def main() -> None:
    """Write the sets, or compare them with the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the files instead of writing them")
    arguments = parser.parse_args()
    hand = gp.load_hand("dlr_hit_ii_right")
    for source, mapping in SETS:
        path = FOLDER / f"{source.name}{mapping.suffix}.csv"
        space = make(source, mapping, hand)
        shares = ", ".join(f"{share:.3f}" for share in space.explained_variance()[:5])
        if arguments.check:
            same = np.allclose(gp.load_synergies(path).basis, space.basis, atol=1e-6)
            print(f"{path.name}: {'up to date' if same else 'DIFFERENT'}")
            if not same:
                raise SystemExit(1)
            continue
        save_synergies(space, path)
        print(f"{path.name}: cumulative variance {shares}")


if __name__ == "__main__":
    main()
