"""The page of the gallery, on two of its objects."""

import re

import pytest
from click.testing import CliRunner

from .scripts import load_script


@pytest.mark.slow
def test_the_gallery_prints_figures_and_writes_its_page(tmp_path):
    script = load_script("make_gallery")
    result = CliRunner().invoke(script.main, ["--objects", "2", "--synergies", "8", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    page = (tmp_path / "gallery.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in page.splitlines() if line.startswith(("| cylinder", "| thin cylinder"))]
    assert len(rows) == 2
    assert "feasible: 2 of 2" in page
    for row in rows:
        assert len(row) == len(script.HEAD)
        assert 1.0 - 1e-3 <= float(row[3]) <= script.MOST_FORCE, "F over the least found"
        assert 0.0 <= float(row[5]) <= 20.0, "five fingers: the least has at most a fifth"
    pictures = re.findall(r"\]\((images/gallery/\S+)\)", page)
    assert len(pictures) == 2
    for picture in pictures:
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")
