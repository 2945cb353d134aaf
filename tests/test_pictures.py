"""Pictures: the renderer against plain geometry, rounded boxes, and that a picture shows what its caption says."""

import numpy as np
import pytest
import trimesh
from PIL import Image

from grasp_planner.drawing import look
from grasp_planner.drawing.film import save_film
from grasp_planner.drawing.meshes import rounded_box
from grasp_planner.drawing.picture import spread
from grasp_planner.drawing.raster import render
from grasp_planner.drawing.solids import framed, grasp_scene
from grasp_planner.drawing.view import DrawnMesh, View

from .documents import ROOT
from .scripts import load_script
from .stored import stored

EYE = np.array([0.0, -1.0, 0.0])
VIEW = View(EYE, np.zeros(3), 0.4, 160, 120)


def ball(centre, radius=0.05, colour=(200, 30, 30), **more):
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    mesh.apply_translation(centre)
    return DrawnMesh(mesh, colour, **more)


def near(image, colour, hue):
    """Return the share of pixels whose channels are ordered as those of a colour, the strongest by so much."""
    image, order = image[..., :3].astype(int), np.argsort(colour)
    strongest, others = image[..., order[2]], image[..., order[:2]]
    return float(np.mean((strongest == image.max(axis=2)) & (strongest - others.min(axis=2) > hue)))


def test_a_ball_covers_what_it_covers_and_no_more():
    image = render([ball((0.0, 0.0, 0.0))], VIEW)
    covered = image[..., 1] < 150
    pixels = VIEW.height / 2.0 / np.tan(0.2) * np.tan(np.arcsin(0.05))
    assert covered.sum() == pytest.approx(np.pi * pixels**2, rel=0.03)
    rows, columns = np.nonzero(covered)
    assert rows.mean() == pytest.approx(59.5, abs=0.5)
    assert columns.mean() == pytest.approx(79.5, abs=0.5)


def test_right_is_right_up_is_up_and_near_hides_far():
    image = render([ball((0.06, 0.0, 0.04), 0.02), ball((0.06, 0.3, 0.04), 0.02, (30, 30, 220))], VIEW)
    rows, columns = np.nonzero((image != 255).any(axis=2))
    assert columns.mean() > 80
    assert rows.mean() < 60
    middle = image[int(rows.mean()), int(columns.mean())].astype(int)
    assert middle[0] > middle[2] + 50


def test_what_is_transparent_shows_what_is_behind_it():
    middle = [
        render([ball((0.0, 0.1, 0.0), 0.03, (30, 30, 220)), ball((0.0, 0.0, 0.0), 0.05, opacity=opacity)], VIEW)[60, 80]
        for opacity in (0.3, 0.9)
    ]
    assert int(middle[0][2]) > int(middle[1][2]) + 30


def test_a_shadow_falls_where_the_key_light_is_hidden():
    ground = trimesh.creation.box([0.6, 0.6, 0.01])
    floor = DrawnMesh(ground, (255, 255, 255), smooth=False, floor=True)
    above = View(np.array([0.0, -0.3, 1.0]), np.zeros(3), 0.6, 120, 120)
    assert (render([floor], above) >= 253).all()
    image = render([floor, ball((0.0, 0.0, 0.1), 0.03)], above)
    grey = (image.max(axis=2) < 250) & (np.ptp(image.astype(int), axis=2) < 6)
    _, columns = np.nonzero(grey)
    assert grey.mean() > 0.005
    assert columns.mean() < 60, "the light comes from the right"


def test_a_rounded_box_is_closed_and_fills_its_box():
    half = (0.03, 0.02, 0.05)
    mesh = rounded_box(half)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.bounds, [[-0.03, -0.02, -0.05], [0.03, 0.02, 0.05]], atol=1e-12)
    assert 0.9 < mesh.volume / (8 * np.prod(half)) < 1.0


def test_labels_keep_their_order_and_their_distance():
    for wanted in ([0.5, 0.51, 0.52, 0.9], [0.97, 0.98, 0.99], [0.1], []):
        found = spread(np.array(wanted), 0.05)
        assert (np.diff(found) > 0.0499).all()
        assert not len(found) or found[-1] <= 1.0


def test_everything_fits_into_the_view():
    solids = grasp_scene(stored("clear")).solids
    for direction in ((1.0, 0.2, 0.3), (0.0, 0.0, 1.0), (-1.0, -1.0, 0.1)):
        view = framed(solids, np.array(direction), 300, 200)
        points = np.concatenate([solid.mesh.vertices for solid in solids if not solid.floor])
        across, down, _ = view.project(points).T
        assert across.min() > 0
        assert across.max() < 300
        assert down.min() > 0
        assert down.max() < 200
        assert max(np.ptp(across) / 300, np.ptp(down) / 200) > 0.8, "the picture is filled"


def pixels_of(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


LEGEND = 70
"""Rows at the foot of a picture that hold the legend."""


def check_picture(pixels):
    for colour, hue, least in (
        (look.FORCE, 90, 1e-3),
        (look.TASK, 60, 1e-3),
        (look.OBJECT, 60, 1e-2),
        (look.FORCE_ELLIPSOID, 45, 2e-3),
    ):
        assert near(pixels[:-LEGEND], colour, hue) > least, colour
    edges = np.concatenate([pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]])
    assert (edges[:, :3] > 250).all(), "nothing is cut off"


def test_the_picture_of_the_readme_is_made_by_its_script_and_shows_what_its_caption_says(tmp_path):
    made = pixels_of(load_script("make_first_picture").save_first_picture(tmp_path))
    check_picture(made)
    kept = pixels_of(ROOT / "docs" / "images" / "first_grasp.png")
    check_picture(kept)
    assert made.shape == kept.shape
    different = np.abs(made.astype(int) - kept).max(axis=2) > 60
    assert different.mean() < 0.01, "python scripts/make_first_picture.py makes it anew"


def test_a_film_ends_in_the_grasp(tmp_path):
    grasp = stored("clear")
    save_film(grasp, [grasp.joint_angles - 0.1], tmp_path / "closing.gif")
    frames = []
    with Image.open(tmp_path / "closing.gif") as film:
        assert film.n_frames == 2
        for index in range(2):
            film.seek(index)
            frames.append(np.asarray(film.convert("RGB")))
    assert near(frames[1], look.FORCE, 90) > near(frames[0], look.FORCE, 90), "forces come with the closed hand"
