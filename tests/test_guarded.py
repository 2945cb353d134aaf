"""Work that may take its process with it."""

import itertools
import os
import time

import pytest

from grasp_planner.exceptions import FileFormatError
from grasp_planner.hand.urdf_file import read_urdf
from grasp_planner.processes import guarded
from grasp_planner.processes.guarded import number_or_death

KILLER = """ply
format binary_little_endian 1.0
element vertex 8
property float x
1e308 float y
property float z
element face 12
property list uchar int vertex_indices
end_header
"""
CORNERS = ("cdccccbc", "cdcccc3c"), ("0ad7a3bc", "0ad7a33c"), ("8fc275bc", "8fc2753c")
BODY = bytes.fromhex("".join(x + y + z for x, y, z in itertools.product(*CORNERS)))[:66] + b"ply"
HAND = """<robot name="r"><link name="a"/><link name="b"><collision><geometry><mesh filename="{mesh}"/></geometry>
</collision></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""


def raises():
    raise MemoryError


@pytest.mark.parametrize(
    ("work", "number"),
    [
        (lambda: 12, 12),
        (lambda: 0, 0),
        (raises, None),
        (os.abort, None),
        (lambda: os._exit(0), None),
        (lambda: len(b"x" * (guarded.LIMIT_BYTES + 10**9)), None),
        (lambda: os.write(2, b"dying words\n"), 12),
    ],
    ids=["number", "zero", "raises", "aborts", "exits", "memory", "words"],
)
def test_what_dies_has_no_number_and_says_nothing(work, number, capfd):
    assert number_or_death(work) == number
    assert capfd.readouterr() == ("", "")


def test_what_takes_too_long_is_ended(monkeypatch):
    monkeypatch.setattr(guarded, "LIMIT_S", 1)
    assert number_or_death(lambda: time.sleep(60)) is None


def test_a_mesh_at_which_the_reader_dies_is_one_error(tmp_path):
    (tmp_path / "link.ply").write_bytes(KILLER.encode() + BODY)
    (tmp_path / "hand.urdf").write_text(HAND.format(mesh="link.ply"))
    with pytest.raises(FileFormatError, match=r"mesh 'link.ply' is no mesh that can be read"):
        read_urdf(tmp_path / "hand.urdf")
