"""Run the notebooks and keep the pictures that the guide shows of them.

Usage: ``python scripts/make_notebook_pictures.py [FOLDER [NAME …]]`` (docs/images and all notebooks if left out).
"""

from __future__ import annotations

import base64
import io
import sys
import tempfile
from pathlib import Path

import nbclient
import nbformat
from PIL import Image

ROOT = Path(__file__).parents[1]
KEPT = {
    "01_hand": 0,
    "02_synergies": 0,
    "03_grasp_statics": -1,
    "04_planning": 0,
    "05_own_object_and_hand": 0,
    "06_batch": 0,
    "07_from_syngrasp": 0,
}
"""Which picture of each notebook, in the order in which it draws them."""
COLOURS, WIDEST = 128, 1000
SECONDS = 300
"""Most time of one cell."""


def pictures_of(path: Path) -> list[bytes]:
    """Return all pictures (PNG) that a notebook draws, run from top to bottom in an empty folder."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        nbclient.NotebookClient(notebook, timeout=SECONDS, resources={"metadata": {"path": folder}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return [
        base64.b64decode(output["data"]["image/png"]) for output in outputs if "image/png" in output.get("data", {})
    ]


def main() -> None:
    """Make them."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "docs" / "images")
    for name in sys.argv[2:] or KEPT:
        pictures = pictures_of(ROOT / "notebooks" / f"{name}.ipynb")
        picture = Image.open(io.BytesIO(pictures[KEPT[name]])).convert("RGB")
        picture.thumbnail((WIDEST, WIDEST))
        path = folder / f"notebook_{name}.png"
        picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2).save(path, optimize=True)
        print(f"{path}: {len(pictures)} pictures, {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main()
