"""The files of the DLR/HIT Hand II against its data sheet, and the two hands against each other."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import coal
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "urdf" / "dlr_hit_ii"
SCRIPT = ROOT / "scripts" / "make_dlr_hit_ii.py"
FINGERS = ("thumb", "index", "middle", "ring", "little")
MIRROR = np.diag([1.0, -1.0, 1.0])

# Fingertips of the right hand in the palm frame [mm], from the DH parameters of the data sheet, for the
# angles of (abduction, MCP, PIP = DIP) in degrees of every finger.
TIPS = {
    (0, 0, 0): (
        (107.62, 64.20, 172.83),
        (-2.53, 36.80, 213.74),
        (-3.70, 10.00, 224.04),
        (-2.53, -16.80, 219.04),
        (0.97, -43.40, 200.04),
    ),
    (0, 30, 30): (
        (36.47, 15.05, 167.01),
        (71.34, 30.34, 168.87),
        (70.45, 10.00, 179.17),
        (71.34, -10.34, 174.17),
        (74.00, -30.52, 155.17),
    ),
    (30, 30, 30): (
        (15.85, 38.02, 163.04),
        (68.72, 0.39, 160.82),
        (70.45, -20.07, 171.12),
        (73.96, -40.29, 166.12),
        (79.22, -60.13, 147.12),
    ),
}
# Collision primitives in their link frames [m]: ends and radius of the capsules, centre and size of the rest.
CAPSULES = {
    "palm_2": ((0.040, 0.034, 0.030), (0.0605, 0.0425, 0.072), 0.0225),
    "proximal_0": ((0.018, 0.004, 0.0), (0.055, 0.002, 0.0), 0.011),
    "medial_0": ((0.0, 0.0, 0.0), (0.025, 0.0, 0.0), 0.011),
    "distal_0": ((0.0, 0.0, 0.0), (0.0165, 0.0, 0.0), 0.010),
}
BOXES = {
    "palm_0": ((0.001, -0.001, 0.048), (0.070, 0.118, 0.100)),
    "palm_1": ((-0.009, 0.010, 0.110), (0.046, 0.084, 0.024)),
}


class Hand:
    """One hand as Pinocchio and its TOML see it."""

    def __init__(self, side: str):
        self.side = side
        self.path = FOLDER / f"dlr_hit_ii_{side}.urdf"
        self.config = tomllib.loads((FOLDER / f"dlr_hit_ii_{side}.toml").read_text(encoding="utf-8"))
        self.xml = ET.parse(self.path).getroot()
        self.model = pin.buildModelFromUrdf(str(self.path))
        self.geometry = pin.buildGeomFromUrdf(self.model, str(self.path), pin.GeometryType.COLLISION)
        self.data = self.model.createData()

    @property
    def palm_mirror(self) -> np.ndarray:
        """The map from the right hand's palm frame to this hand's."""
        return np.eye(3) if self.side == "right" else MIRROR

    def joint(self, name: str) -> int:
        """Return Pinocchio's number of a joint."""
        assert self.model.existJointName(name), name
        return self.model.getJointId(name)

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the bounds of the independent joints."""
        rows = [self.model.idx_qs[self.joint(name)] for name in self.config["joints"]]
        return self.model.lowerPositionLimit[rows], self.model.upperPositionLimit[rows]

    def full(self, angles: np.ndarray) -> np.ndarray:
        """Complete the independent angles with DIP = PIP, in Pinocchio's order."""
        q = np.zeros(self.model.nq)
        for name, angle in zip(self.config["joints"], angles, strict=True):
            q[self.model.idx_qs[self.joint(name)]] = angle
            if name.endswith("_pip"):
                q[self.model.idx_qs[self.joint(name.replace("_pip", "_dip"))]] = angle
        return q

    def move(self, angles: np.ndarray) -> None:
        """Take a posture."""
        pin.framesForwardKinematics(self.model, self.data, self.full(angles))

    def frame(self, name: str) -> pin.SE3:
        """Return the pose of a frame in the palm frame."""
        assert self.model.existFrame(name), name
        return self.data.oMf[self.model.getFrameId(name)]

    def tips(self) -> np.ndarray:
        """Return the DH tips, one a row."""
        return np.array([self.frame(f"{finger}_tip").translation for finger in FINGERS])

    def postures(self, count: int, seed: int = 0) -> Iterator[np.ndarray]:
        """Draw postures within the limits."""
        rng = np.random.default_rng(seed)
        yield from rng.uniform(*self.limits(), size=(count, 15))


HANDS = {side: Hand(side) for side in ("right", "left")}


@pytest.fixture(params=HANDS)
def hand(request: pytest.FixtureRequest) -> Hand:
    return HANDS[request.param]


@pytest.mark.parametrize("angles", TIPS, ids=str)
def test_fingertips_agree_with_the_data_sheet(hand, angles):
    """The DH tips lie where the maker's DH parameters put them, on the left hand mirrored."""
    hand.move(np.tile(np.radians(angles), 5))
    np.testing.assert_allclose(hand.tips() @ hand.palm_mirror * 1e3, TIPS[angles], atol=0.01)


def test_joint_limits(hand):
    """Abduction moves by 15 degrees to either side, the MCP flexes to 85 and PIP and DIP to 65 degrees."""
    lower, upper = np.degrees(hand.limits())
    np.testing.assert_allclose(lower, [-15, 0, 0] * 5, atol=1e-7)
    np.testing.assert_allclose(upper, [15, 85, 65] * 5, atol=1e-7)
    for finger in FINGERS:
        dip, pip = (hand.model.idx_qs[hand.joint(f"{finger}_{name}")] for name in ("dip", "pip"))
        for limit in (hand.model.lowerPositionLimit, hand.model.upperPositionLimit):
            assert limit[dip] == limit[pip]
    assert (hand.model.upperEffortLimit > 0).all() and (hand.model.upperVelocityLimit > 0).all()


def test_distal_joints_mimic_their_neighbours(hand):
    """Every DIP joint follows its PIP joint one to one, and nothing else is coupled."""
    coupled = [joint for joint in hand.xml.iter("joint") if joint.find("mimic") is not None]
    mimics = {joint.get("name"): joint.find("mimic").attrib for joint in coupled}
    expected = {f"{f}_dip": {"joint": f"{f}_pip", "multiplier": "1", "offset": "0"} for f in FINGERS}
    assert mimics == expected


def test_flexion_bends_towards_the_palm(hand):
    """Positive flexion takes the four fingers out of the palm plane and the thumb back over the palm."""
    hand.move(np.zeros(15))
    before = hand.tips() @ hand.palm_mirror
    for joint in (1, 2):
        angles = np.zeros(15)
        angles[joint::3] = 0.1
        hand.move(angles)
        shift = hand.tips() @ hand.palm_mirror - before
        assert (shift[1:, 0] > 2e-3).all()
        assert (shift[0] * [-1.0, -1.0, 1.0] > 1e-3).all()


def test_growing_abduction_angles_spread_the_fingers(hand):
    """Angles growing along remark 1's order spread neighbouring fingers, falling ones let them meet."""
    config = hand.config["remark1"]
    gaps = []
    for step in (-4.0, 0.0, 4.0):
        angles = np.zeros(15)
        for number, name in enumerate(config["abduction_order"]):
            angles[hand.config["joints"].index(name)] = config["sign"] * np.radians(step * (number - 1.5))
        hand.move(angles)
        order = [FINGERS.index(name.removesuffix("_abd")) for name in config["abduction_order"]]
        gaps.append(-np.diff((hand.tips() @ hand.palm_mirror)[order, 1]))
    assert (gaps[0] < gaps[1]).all() and (gaps[1] < gaps[2]).all() and (gaps[2] > 0).all()


def test_tip_and_pad_frames_point_along_the_finger(hand):
    """At the end of each finger z goes on along the distal phalanx, and pad and tip lie on that line."""
    for angles in hand.postures(5):
        hand.move(angles)
        for finger in FINGERS:
            distal, tip, pad = (hand.frame(f"{finger}_{name}") for name in ("distal", "tip", "pad"))
            axis = distal.rotation[:, 0]
            np.testing.assert_allclose(tip.rotation[:, 2], axis, atol=1e-9)
            np.testing.assert_allclose(tip.translation, distal.translation + 0.025 * axis, atol=1e-9)
            np.testing.assert_allclose(pad.translation, distal.translation + 0.0165 * axis, atol=1e-9)
            np.testing.assert_allclose(tip.rotation[:, 0], distal.rotation[:, 1], atol=1e-9)


def test_equal_angles_are_mirrored_postures():
    """At equal joint angles tips, centres of mass, inertias and solids of the hands mirror each other."""
    right, left = HANDS["right"], HANDS["left"]
    for angles in right.postures(50):
        right.move(angles)
        left.move(angles)
        np.testing.assert_allclose(left.tips(), right.tips() @ MIRROR, atol=1e-8)
        for joint, (a, b) in enumerate(zip(right.model.inertias, left.model.inertias, strict=True)):
            a, b = right.data.oMi[joint].act(a), left.data.oMi[joint].act(b)
            assert b.mass == a.mass
            np.testing.assert_allclose(b.lever, MIRROR @ a.lever, atol=1e-8)
            np.testing.assert_allclose(b.inertia, MIRROR @ a.inertia @ MIRROR, atol=1e-10)
        for a, b in zip(right.geometry.geometryObjects, left.geometry.geometryObjects, strict=True):
            assert a.name == b.name
            a, b = right.data.oMi[a.parentJoint] * a.placement, left.data.oMi[b.parentJoint] * b.placement
            np.testing.assert_allclose(b.translation, MIRROR @ a.translation, atol=1e-8)


def test_mass(hand):
    """The hand weighs 1.5 kg; frames and tips have no mass of their own."""
    assert sum(inertia.mass for inertia in hand.model.inertias) == pytest.approx(1.5, abs=1e-9)
    massless = {link.get("name") for link in hand.xml.iter("link") if link.find("inertial") is None}
    assert massless == {f"{finger}_{name}" for finger in FINGERS for name in ("tip", "pad")}


def test_inertias_belong_to_real_bodies(hand):
    """Principal moments of inertia are positive, and none exceeds the sum of the other two."""
    for inertia in hand.model.inertias:
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert moments[0] > 0
        assert moments[2] < moments[0] + moments[1]


def test_pinocchio_and_yourdfpy_agree(hand):
    """Two independent parsers put the frames of all fingertips at the same place."""
    robot = yourdfpy.URDF.load(hand.path, build_scene_graph=True, load_meshes=False)
    joints = hand.config["joints"]
    assert set(robot.actuated_joint_names) == set(joints)
    for angles in hand.postures(20):
        hand.move(angles)
        robot.update_cfg(dict(zip(joints, angles, strict=True)))
        for finger in FINGERS:
            for name in (f"{finger}_tip", f"{finger}_pad"):
                np.testing.assert_allclose(robot.get_transform(name), hand.frame(name).homogeneous, atol=1e-9)


def test_yourdfpy_loads_without_complaint(hand, caplog):
    """A strict reader finds every link, joint, material and solid it expects."""
    with caplog.at_level("WARNING"):
        robot = yourdfpy.URDF.load(hand.path, build_collision_scene_graph=True, load_collision_meshes=True)
        assert robot.validate()
    assert not caplog.records
    assert len(robot.robot.links) == 1 + 6 * 5
    assert sum(len(link.collisions) for link in robot.robot.links) == 3 + 4 * 5
    drawn = {visual.material.name for link in robot.robot.links for visual in link.visuals}
    assert drawn == {material.name for material in robot.robot.materials}


def local(hand: Hand, geometry: pin.GeometryObject) -> SimpleNamespace:
    """Return a collision geometry's short name, its pose in its link frame, and the mirror of that frame."""
    frame = hand.model.frames[geometry.parentFrame]
    name = geometry.name if frame.name == "palm" else geometry.name.split("_", 1)[1]
    mirror = hand.palm_mirror
    if frame.name != "palm" and hand.side == "left":
        mirror = np.diag([1.0, 1.0, -1.0])
    return SimpleNamespace(name=name, pose=frame.placement.actInv(geometry.placement), mirror=mirror)


def test_cylinders_become_capsules(hand):
    """Pinocchio turns every named cylinder into a capsule with the table's end points and radius."""
    found = 0
    for geometry in hand.geometry.geometryObjects:
        part, shape = local(hand, geometry), geometry.geometry
        assert not isinstance(shape, coal.Cylinder)
        if part.name not in CAPSULES:
            continue
        found += 1
        assert isinstance(shape, coal.Capsule)
        start, end, radius = (np.array(value) for value in CAPSULES[part.name])
        assert shape.radius == pytest.approx(radius)
        for sign, point in ((-1, start), (1, end)):
            reached = part.pose.act(np.array([0.0, 0.0, sign * shape.halfLength]))
            np.testing.assert_allclose(reached, part.mirror @ point, atol=1e-9)
    assert found == 1 + 3 * len(FINGERS) == sum(1 for _ in hand.xml.iter("capsule"))


def test_boxes_and_pads(hand):
    """The palm is two boxes, and each fingertip's contact patch is a sphere about the pad frame."""
    rest = [g for g in hand.geometry.geometryObjects if not isinstance(g.geometry, coal.Capsule)]
    assert len(rest) == len(BOXES) + len(FINGERS)
    for geometry in rest:
        part, shape = local(hand, geometry), geometry.geometry
        if part.name in BOXES:
            centre, size = BOXES[part.name]
            np.testing.assert_allclose(part.pose.translation, part.mirror @ centre, atol=1e-12)
            np.testing.assert_allclose(2 * shape.halfSide, size, atol=1e-12)
        else:
            assert part.name == "pad_0" and isinstance(shape, coal.Sphere)
            assert shape.radius == 0.010
            np.testing.assert_allclose(part.pose.translation, 0.0, atol=1e-12)


def checked_distances(hand: Hand, angles: np.ndarray) -> dict[tuple[str, str], float]:
    """Return the distances of all pairs of links which the TOML does not ignore."""
    geometry = hand.geometry.copy()
    links = [hand.model.frames[g.parentFrame].name for g in geometry.geometryObjects]
    ignored = {frozenset(pair) for pair in hand.config["collision"]["ignore"]}
    pairs = [(i, j) for j in range(len(links)) for i in range(j) if links[i] != links[j]]
    for i, j in pairs:
        if frozenset((links[i], links[j])) not in ignored:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
    data = pin.GeometryData(geometry)
    pin.computeDistances(hand.model, hand.data, geometry, data, hand.full(angles))
    return {
        (links[pair.first], links[pair.second]): result.min_distance
        for pair, result in zip(geometry.collisionPairs, data.distanceResults, strict=True)
    }


def test_the_open_hand_is_free_of_collisions(hand):
    """With straight fingers, together or spread, no checked pair of links touches."""
    for spread in (0.0, 3.0):
        angles = np.zeros(15)
        angles[3::3] = np.radians(spread) * np.array([-1.5, -0.5, 0.5, 1.5])
        assert min(checked_distances(hand, angles).values()) > 4e-3


def test_the_thumb_meets_the_index_finger(hand):
    """When all fingers flex by 30 degrees thumb and index finger run into each other by about 9 mm."""
    distances = checked_distances(hand, np.tile(np.radians([0, 30, 30]), 5))
    pair = min(distances, key=distances.__getitem__)
    assert {link.split("_")[0] for link in pair} == {"thumb", "index"}
    assert distances[pair] == pytest.approx(-9e-3, abs=1e-3)


def test_toml_names_what_the_urdf_has(hand):
    """Joints, contact frames and ignored links of the TOML exist, and q is the set of independent joints."""
    config = hand.config
    assert config["name"] == hand.xml.get("name") == hand.path.stem
    assert config["urdf"] == hand.path.name
    moving = [joint for joint in hand.xml.iter("joint") if joint.get("type") == "revolute"]
    independent = [joint.get("name") for joint in moving if joint.find("mimic") is None]
    assert config["joints"] == independent
    assert set(config["remark1"]["abduction_order"]) <= set(independent)
    links = {link.get("name") for link in hand.xml.iter("link")}
    solid = {link.get("name") for link in hand.xml.iter("link") if link.find("collision") is not None}
    assert config["palm"]["link"] in links
    assert np.linalg.norm(config["palm"]["normal"]) == pytest.approx(1.0)
    for name, contacts in config["contact_sets"].items():
        assert list(contacts) == list(FINGERS) or name in ("power", "links")
        assert {contact["frame"] for contact in contacts.values()} <= links
    ignored = [frozenset(pair) for pair in config["collision"]["ignore"]]
    assert len(set(ignored)) == len(ignored) and set().union(*ignored) <= solid
    assert config["synergies"]["default"] in config["synergies"]["sets"]


def test_tomls_mirror_each_other():
    """The two descriptions differ only in their names and in the side of the grasp centre."""
    right, left = (dict(HANDS[side].config) for side in ("right", "left"))
    for key in ("name", "title", "urdf"):
        assert left.pop(key) == right.pop(key).replace("right", "left")
    centres = [np.array(config["palm"]["grasp_centre"]) for config in (right, left)]
    np.testing.assert_array_equal(centres[1], MIRROR @ centres[0])
    assert {**right, "palm": None} == {**left, "palm": None}


def test_committed_urdfs_are_what_the_script_writes(tmp_path):
    """The URDFs in the repository are those of the table, and a stale or missing one is noticed."""
    run = [sys.executable, str(SCRIPT), "--check"]
    assert subprocess.run(run, check=False).returncode == 0
    assert subprocess.run([*run, "--output", str(tmp_path)], check=False, capture_output=True).returncode == 1
    assert not list(tmp_path.iterdir())
