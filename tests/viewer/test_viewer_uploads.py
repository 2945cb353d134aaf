"""Meshes and hands from the page."""

import json
import stat
from pathlib import Path

import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.viewer.drop_script import PLACES, drop_script
from grasp_planner.viewer.panels.chapters import CHAPTERS
from grasp_planner.viewer.panels.from_files import READING
from grasp_planner.viewer.uploads import MAX_UPLOAD_BYTES, Uploads

from ..documents import ROOT

URDF = (ROOT / "urdf" / "tendon_hand" / "tendon_hand.urdf").read_bytes()


def cube(side):
    return trimesh.creation.box((side, side, side)).export(file_type="stl")


@pytest.fixture(scope="module")
def uploads():
    made = Uploads()
    yield made
    made.close()


@pytest.fixture
def client_upload(client):
    """Send a file to a button as a page does."""

    def send(label, name, content, claimed=None):
        uuid = client.widget(label)["uuid"]
        start = {"filename": name, "mime_type": "", "part_count": 1, "size_bytes": claimed or len(content)}
        known = {"source_component_uuid": uuid, "transfer_uuid": name}
        client.send(type="FileTransferStartUpload", **known, **start)
        client.send(type="FileTransferPart", **known, part_index=0, content=content)

    return send


def test_a_mesh_has_the_unit_it_was_given_and_doubts_are_said(uploads):
    found = uploads.mesh("../../mug.STL", cube(40.0), "millimetres")
    assert found.grasp_object.half_extents == pytest.approx(np.full(3, 0.02), rel=1e-3)
    assert not found.notes
    doubted = uploads.mesh("mug.stl", cube(40.0), "metres")
    assert "mm" in " ".join(doubted.notes) or "millimetres" in " ".join(doubted.notes)


def test_the_folder_is_private_and_goes_with_the_viewer():
    uploads = Uploads()
    path = Path(uploads.mesh("/etc/../x.stl", cube(0.04), "metres").grasp_object.path)
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert path.name != "x.stl"
    uploads.close()
    assert not path.parent.exists()
    uploads.close()


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("mug.exe", b"x", "ends in .stl"),
        ("stl", b"x", "ends in .stl"),
        ("mug.stl", b"no triangles", "stl"),
        ("mug.stl", b"", "stl"),
        ("mug.stl", b" " * (MAX_UPLOAD_BYTES + 1), "at most 20 MB"),
    ],
)
def test_what_is_no_solid_is_refused_in_one_line(uploads, name, content, words):
    with pytest.raises(gp.GraspPlannerError, match=words) as caught:
        uploads.mesh(name, content, "metres")
    assert "\n" not in str(caught.value)


def test_a_hand_is_taken_for_no_other_one_and_needs_no_other_file(uploads):
    one, other = (uploads.hand("hand.urdf", content).hand for content in (URDF, URDF + b"\n"))
    assert one.name != other.name
    assert one.joint_names == other.joint_names
    with pytest.raises(gp.GraspPlannerError, match=r"ends in \.urdf"):
        uploads.hand("hand.xacro", URDF)
    with pytest.raises(gp.GraspPlannerError):
        uploads.hand("hand.urdf", URDF.replace(b"<robot", b"<!DOCTYPE x [<!ENTITY a 'b'>]><robot", 1))


def test_a_mesh_and_a_hand_from_the_page_are_shown(viewer, client, client_upload):
    client_upload("Open an object (mesh)", "cube.stl", cube(0.05))
    client.until(lambda: viewer.session.problem.grasp_object.kind == "mesh", 60.0)
    assert viewer.worker.drain(60.0)
    assert viewer.problem.kind.value == "mesh"
    assert "not planned yet" in viewer.card.widget.content
    before = viewer.session.problem.grasp_object
    client_upload("Open a hand (URDF)", "hand.urdf", URDF)
    client.until(lambda: viewer.session.problem.hand.name.startswith("tendon_hand-"), 60.0)
    assert viewer.worker.drain(60.0)
    problem = viewer.session.problem
    assert viewer.problem.hand.value == problem.hand.name, "shown is used"
    assert viewer.synergies.count.value == problem.n_synergies
    assert problem.grasp_object != before, "a first object in size for it"
    assert not viewer.files.hand._complaint.visible
    assert not viewer.share.last_error
    with pytest.raises(gp.InvalidValueError, match="the hand of a link"):
        viewer.share.query()
    viewer.problem.hand.value = "dlr_hit_ii_right"
    assert viewer.worker.drain(60.0)
    assert viewer.session.problem.hand.name == "dlr_hit_ii_right"


def test_an_error_stands_beside_its_button_and_nothing_changes(viewer, client, client_upload):
    before = viewer.session.grasp
    line = viewer.files.mesh._complaint
    client_upload("Open an object (mesh)", "cube.stl", b"solid nothing")
    client.until(lambda: line.visible and READING not in line.content, 30.0)
    assert viewer.session.grasp is before
    client_upload("Open an object (mesh)", "cube.obj", b"x", claimed=MAX_UPLOAD_BYTES + 1)
    client.until(lambda: "Notification" in " ".join(client.kinds))
    assert not viewer.server.gui._current_file_upload_states


def test_what_is_dropped_goes_to_a_tab_that_exists():
    assert set(PLACES.values()) <= {*CHAPTERS, "Share"}
    assert json.dumps(PLACES) in drop_script()
