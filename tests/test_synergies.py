"""Synergy spaces, their principal components, their files, and the sets that ship with the hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.synergies.space import synergies_from_covariance

from .scripts import load_script

NAMES = ("a", "b", "c", "d")
SYNERGIES = Path(gp.__file__).parents[1] / "urdf" / "dlr_hit_ii" / "synergies"
SHIPPED = ("santello", "uji", "santello_clear")
THUMBS = {
    "dlr_hit_ii": ("thumb_abd", "thumb_mcp", "thumb_pip"),
    "allegro": ("joint_12.0", "joint_13.0", "joint_14.0", "joint_15.0"),
}
"""Joints of the thumbs, by hand."""


def random_space(n: int = 4, *, variance: bool = True) -> gp.SynergySpace:
    rng = np.random.default_rng(3)
    basis, _ = np.linalg.qr(rng.normal(size=(4, 4)))
    values = np.array([4.0, 2.0, 1.0, 0.5])[:n] if variance else None
    return gp.SynergySpace(NAMES, rng.normal(size=4), basis[:, :n], values, "random", "line one\nline two")


def test_pca_recovers_a_known_plane():
    rng = np.random.default_rng(0)
    plane, _ = np.linalg.qr(rng.normal(size=(4, 2)))
    mean = rng.normal(size=4)
    postures = mean + (rng.normal(size=(400, 2)) * [2.0, 0.7]) @ plane.T
    space = gp.synergies_from_postures(NAMES, postures, name="plane")
    assert space.mean == pytest.approx(postures.mean(axis=0))
    # The first two components span the plane, the others complete it to the whole joint space.
    assert np.linalg.norm(plane.T @ space.basis[:, :2]) == pytest.approx(np.sqrt(2.0))
    assert space.basis.T @ space.basis == pytest.approx(np.eye(4), abs=1e-12)
    assert space.variance[2:] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert space.explained_variance()[1] == pytest.approx(1.0)
    assert (np.diff(space.variance) <= 0.0).all()


def test_pca_of_few_postures_still_gives_a_full_basis():
    space = gp.synergies_from_postures(NAMES, np.eye(4)[:2])
    assert space.basis.shape == (4, 4)
    assert space.basis.T @ space.basis == pytest.approx(np.eye(4), abs=1e-12)


def test_pca_is_deterministic_in_its_signs():
    postures = np.random.default_rng(1).normal(size=(30, 4))
    space = gp.synergies_from_postures(NAMES, postures)
    again = gp.synergies_from_postures(NAMES, postures[::-1])
    assert again.basis == pytest.approx(space.basis, abs=1e-9)
    largest = np.abs(space.basis).argmax(axis=0)
    assert (space.basis[largest, range(4)] > 0.0).all()


def test_posture_and_coordinates_are_inverse():
    space = random_space(2)
    sigma = np.array([0.3, -0.7])
    q = space.joint_angles(sigma)
    assert q == pytest.approx(space.mean + space.basis @ sigma)
    assert space.coordinates(q) == pytest.approx(sigma)
    # Least squares: what is normal to the synergies does not count.
    assert space.coordinates(q + space.complement() @ [1.0, 2.0]) == pytest.approx(sigma)


def test_complement_is_the_orthonormal_rest():
    space = random_space(3)
    rest = space.complement()
    assert rest.shape == (4, 1)
    assert rest.T @ rest == pytest.approx(np.eye(1))
    assert space.basis.T @ rest == pytest.approx(np.zeros((3, 1)), abs=1e-12)
    assert random_space(4).complement().shape == (4, 0)


def test_truncation():
    space = random_space()
    assert space.truncated(2).basis == pytest.approx(space.basis[:, :2])
    assert space.truncated(2).variance == pytest.approx([4.0, 2.0])
    for n in (0, 5, 2.0, True):
        with pytest.raises(gp.InvalidValueError) as error:
            space.truncated(n)
        assert error.value.field == "n_synergies"
        assert error.value.value is n


def test_reordering_goes_by_name():
    space = random_space(2)
    turned = space.reordered(NAMES[::-1])
    assert turned.basis == pytest.approx(space.basis[::-1])
    assert turned.mean == pytest.approx(space.mean[::-1])
    with pytest.raises(gp.NameNotFoundError) as error:
        space.reordered(("a", "b", "c", "e"))
    assert error.value.name == "e"
    with pytest.raises(gp.InvalidValueError):
        space.reordered(("a", "b", "c"))


def test_arrays_cannot_be_written():
    space = random_space()
    for array in (space.mean, space.basis, space.variance):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"mean": [0.0, 0.0]}, "mean"),
        ({"basis": np.ones((4, 1))}, "basis"),
        ({"basis": np.column_stack([np.eye(4)[0], np.eye(4)[0]])}, "basis"),
        ({"basis": np.full((4, 1), np.nan)}, "basis"),
        ({"variance": [-1.0, 0.0, 0.0, 0.0]}, "variance"),
        ({"joint_names": ("a", "a", "b", "c")}, "joint_names"),
    ],
)
def test_inconsistent_spaces_are_refused(change, word):
    fields = {"joint_names": NAMES, "mean": np.zeros(4), "basis": np.eye(4), **change}
    with pytest.raises(gp.InvalidValueError, match=word):
        gp.SynergySpace(**fields)


def test_covariance_has_to_be_symmetric_and_postures_many():
    with pytest.raises(gp.InvalidValueError, match="covariance"):
        synergies_from_covariance(NAMES, np.zeros(4), np.triu(np.ones((4, 4))))
    with pytest.raises(gp.InvalidValueError, match="postures"):
        gp.synergies_from_postures(NAMES, np.zeros((1, 4)))
    with pytest.raises(gp.InvalidValueError, match="variance"):
        random_space(variance=False).explained_variance()


@pytest.mark.parametrize("variance", [True, False])
def test_files_keep_every_digit(tmp_path, variance):
    space, path = random_space(3, variance=variance), tmp_path / "set.csv"
    gp.save_synergies(space, path)
    loaded = gp.load_synergies(path)
    assert (loaded.basis == space.basis).all()
    assert (loaded.mean == space.mean).all()
    assert loaded.joint_names == space.joint_names
    assert (loaded.name, loaded.provenance) == (space.name, space.provenance)
    assert (loaded.variance is None) is not variance
    if variance:
        assert (loaded.variance == space.variance).all()


HEADER = "joint,mean_rad,s1\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "header"),
        ("joint,mean,s1\na,0,1\n", "header"),
        (HEADER + "a,0\n", "row 2"),
        (HEADER + "a,0,1,2\n", "row 2"),
        (HEADER + "a,zero,1\n", "'zero'"),
        (HEADER + "a,0,nan\n", "s1"),
        (HEADER + "a,0,1e999\n", "1e999"),
        (HEADER, "basis"),
        (HEADER + "a,0,1\na,0,1\n", "joint_names"),
        (HEADER + "a,0,0.5\n", "length 1"),
        (HEADER + "a,0,1\nvariance,,-1\n", "variance"),
        (HEADER + "variance,,1\na,0,1\n", "row 3"),
        ("joint,mean_rad,s2\na,0,1\n", "header"),
        (HEADER + '"a,0,1\n', "comma-separated"),
        (HEADER + "a,0," + "1" * 200_000 + "\n", "comma-separated"),
    ],
)
def test_malformed_files_are_refused(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(gp.FileFormatError, match=words) as error:
        gp.load_synergies(path)
    assert error.value.path == path


@pytest.mark.parametrize("name", ["x,y", 'x"', "#x", "x\ny", "variance"])
def test_names_that_would_not_be_read_back_are_not_written(tmp_path, name):
    space = gp.SynergySpace((name,), np.zeros(1), np.eye(1))
    with pytest.raises(gp.InvalidValueError, match="name"):
        gp.save_synergies(space, tmp_path / "set.csv")
    assert not (tmp_path / "set.csv").exists()


def test_missing_oversized_and_binary_files_are_refused(tmp_path):
    with pytest.raises(gp.FileFormatError):
        gp.load_synergies(tmp_path / "none.csv")
    big = tmp_path / "big.csv"
    big.write_bytes(b"#" * 1_000_001)
    with pytest.raises(gp.FileFormatError, match="1000000"):
        gp.load_synergies(big)
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(gp.FileFormatError, match="UTF-8"):
        gp.load_synergies(binary)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_sets_are_orthonormal_and_fit_the_hand(name):
    space = gp.load_synergies(SYNERGIES / f"{name}.csv")
    hand = gp.load_hand("dlr_hit_ii_right")
    assert space.name == name
    assert space.provenance
    assert space.n_synergies == space.n_joints == 15
    assert np.abs(space.basis.T @ space.basis - np.eye(15)).max() < 1e-12
    assert sorted(space.joint_names) == sorted(hand.joint_names)
    mean = space.reordered(hand.joint_names).mean
    assert ((mean > hand.lower) & (mean < hand.upper)).all()
    assert (np.diff(space.variance) <= 0.0).all()


@pytest.mark.parametrize("name", SHIPPED)
def test_first_synergy_closes_all_fingers_and_moves_the_thumb(name):
    """What the sets are for: with one synergy all fingers close, or open, together, and the thumb takes part."""
    space = gp.load_synergies(SYNERGIES / f"{name}.csv")
    first = dict(zip(space.joint_names, space.basis[:, 0], strict=True))
    assert len({first[f"{finger}_mcp"] > 0.0 for finger in ("index", "middle", "ring", "little")}) == 1
    assert np.linalg.norm([first[f"thumb_{joint}"] for joint in ("abd", "mcp", "pip")]) > 0.1


@pytest.mark.parametrize("name", ["dlr_hit_ii_right", "dlr_hit_ii_left", "allegro_right"])
def test_two_motors_move_the_thumb_and_all_other_fingers(name):
    hand = gp.load_hand(name)
    space, whole = hand.synergies("thumb_and_fingers"), hand.synergies("native_clear").truncated(1)
    assert space.n_synergies == 2
    np.testing.assert_array_equal(space.mean, whole.mean)
    moved = space.basis != 0.0
    assert not (moved[:, 0] & moved[:, 1]).any(), "no joint has two motors"
    thumb = {joint for joint, on in zip(space.joint_names, moved[:, 0], strict=True) if on}
    assert thumb == set(THUMBS[hand.name.rpartition("_")[0]])
    # What one motor of the whole set reaches, two motors do.
    outside = whole.basis[:, 0] - space.basis @ (space.basis.T @ whole.basis[:, 0])
    assert np.abs(outside).max() < 1e-12


def test_the_script_makes_the_derived_sets_that_are_there(monkeypatch):
    monkeypatch.setattr("sys.argv", ["make_derived_sets.py", "--check"])
    assert load_script("make_derived_sets").main() == 0


@pytest.mark.parametrize("human", ["santello", "uji"])
def test_a_recentred_set_moves_as_humans_do_about_another_mean(human):
    hand = gp.load_hand("dlr_hit_ii_right")
    space = hand.synergies(f"{human}_recentred")
    np.testing.assert_array_equal(space.basis, hand.synergies(human).basis)
    np.testing.assert_array_equal(space.mean, hand.synergies("native_clear").mean)
    assert "the mean posture is not" in space.provenance
