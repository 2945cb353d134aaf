"""The folder of what comes from files: a mesh as object, a URDF as hand."""

from __future__ import annotations

from collections.abc import Callable

from ...exceptions import GraspPlannerError
from ...files.reading import MESH_SUFFIXES
from ..problem_edits import ProblemEdits
from ..server import LocalServer
from ..uploads import MAX_UPLOAD_BYTES, UNITS, URDF_SUFFIXES, Uploads
from .widgets import UploadField

READING = "reading …"
SIZE = f"at most {MAX_UPLOAD_BYTES // 1_000_000} MB; or drop it on the page"


class FromFilesPanel:
    """Upload buttons of meshes and hands.

    Attributes:
        unit: Unit of mesh files.
        mesh: Button of the object.
        hand: Button of the hand.
        uploads: Where the files are kept.
    """

    def __init__(self, server: LocalServer) -> None:
        """Add the widgets to the present container.

        Args:
            server: The server, which lets only small files through.
        """
        gui = server.gui
        self.uploads = Uploads()
        with gui.add_folder("From files", expand_by_default=False):
            self.unit = gui.add_dropdown("Unit of the mesh", tuple(UNITS))
            self.mesh = UploadField(gui, "Open an object (mesh)", MESH_SUFFIXES, f"A closed surface, {SIZE}")
            self.hand = UploadField(gui, "Open a hand (URDF)", URDF_SUFFIXES, f"Of primitive shapes, {SIZE}")
        for field in (self.mesh, self.hand):
            server.upload_limits[field.button._impl.uuid] = MAX_UPLOAD_BYTES

    def connect(self, edits: ProblemEdits, later: Callable[..., None], look: Callable[[], None]) -> None:
        """Connect the buttons with what they change.

        Args:
            edits: What changes the problem.
            later: Has the worker do something.
            look: Has every page look at the new hand or object; called in the worker's thread.
        """

        def take_mesh(name: str, content: bytes) -> None:
            found = self.uploads.mesh(name, content, self.unit.value)
            edits.take_object(found.grasp_object, found.notes)

        def take_hand(name: str, content: bytes) -> None:
            edits.take_hand(self.uploads.hand(name, content))

        def connect(field: UploadField, take: Callable[[str, bytes], None]) -> None:
            def work() -> None:
                file = field.button.value
                try:
                    take(file.name, file.content)
                except GraspPlannerError as error:
                    field.complain(str(error))
                    return
                field.complain("")
                look()

            def taken(_: object) -> None:
                field.complain(READING)
                later(work)

            field.button.on_upload(taken)

        connect(self.mesh, take_mesh)
        connect(self.hand, take_hand)
