"""The page of the gallery, on two of its objects."""

import re

import pytest
from click.testing import CliRunner

from .scripts import load_script


@pytest.mark.slow
def test_the_gallery_prints_figures_and_writes_its_page(tmp_path):
    script = load_script("make_gallery")
    asked = ["--hands", "dlr_hit_ii_right,tendon_hand", "--objects", "2", "--synergies", "8"]
    result = CliRunner().invoke(script.main, [*asked, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    page = (tmp_path / "gallery.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith(("| cylinder", "| thin cylinder"))]
    assert len(rows) == 4, "two objects and two hands"
    assert page.count("feasible: 2 of 2") == 2
    assert "feasible: 4 of 4" in page
    for row in rows:
        assert len(row) == len(script.HEAD)
        assert 1.0 - 1e-3 <= float(row[3]) <= script.MOST_FORCE, "F over the least found"
        most = 20.0 if row[1] == "8" else 34.0  # five fingers, and three
        assert 0.0 <= float(row[6]) <= most, "the least finger has at most its share"
        better = re.match(r"(\d+)° at ", row[5])
        assert row[5] == "" or (better and float(better[1]) < float(row[4])), "a better angle is better"
    pictures = re.findall(r"\]\((images/gallery/\S+)\)", page)
    assert len(pictures) == 4
    for picture in pictures:
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")
