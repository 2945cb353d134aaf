"""The tab of files: grasps as JSON in and out, one HTML page that opens offline, pictures."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import viser

from ...exceptions import FileFormatError, GraspPlannerError, InvalidValueError
from ...hand.description import hand_library
from ...hand.loading import load_hand
from ...problem.problem import GraspProblem
from ...problem.search_options import PlannerOptions
from ...records.grasp_files import grasp_json, parse_grasp_record
from ...records.grasp_record import grasp_from_record
from ..equivalent import command_text, python_text, what_is_lost
from ..export import grasp_html
from ..page_links import copy_link, copy_text
from ..session import Session
from ..state_link import state_query

PICTURE_SIZE = (1080, 1440)
"""Height and width of a saved picture."""

LINK, COMMAND, PYTHON = "link", "command", "Python"
Later = Callable[..., None]


class SharePanel:
    """Up- and download buttons.

    Attributes:
        upload: Button that reads a grasp file.
        last_error: The last error shown on the page, for whoever looks from outside.
    """

    def __init__(self, server: viser.ViserServer, session: Session, later: Later) -> None:
        self._server, self._session, self._later = server, session, later
        self.last_error = ""
        self._told: GraspProblem | None = None
        self._search = (PlannerOptions(), 0, 1)
        gui = server.gui
        self.upload = gui.add_upload_button("Open a grasp (JSON)", icon=viser.Icon.UPLOAD, mime_type="application/json")
        self.json = gui.add_button("Save the grasp (JSON)", icon=viser.Icon.DOWNLOAD)
        self.html = gui.add_button("Save as a web page (HTML)", icon=viser.Icon.WORLD, hint="One file, opens offline")
        self.png = gui.add_button("Save a picture (PNG)", icon=viser.Icon.CAMERA)
        gui.add_markdown(
            "The **JSON** file is what `grasp-planner` writes and reads. The **HTML** file holds the grasp, its "
            "closing animation and its numbers; it needs neither network nor server."
        )
        self.copy = gui.add_button_group(
            "Copy", (LINK, COMMAND, PYTHON), hint="The link opens this problem, search and posture; the others plan it"
        )
        with gui.add_folder("The same as a command, and in Python"):
            self._same = gui.add_markdown("")
        self.upload.on_upload(lambda event: self._open(event.client, self.upload.value.content))
        self.json.on_click(lambda event: self._send(event.client, "grasp.json", self._json))
        self.html.on_click(lambda event: self._send(event.client, "grasp.html", self._html))
        self.png.on_click(lambda event: self._picture(event.client))
        self.copy.on_click(lambda event: self._copy(event.client, str(self.copy.value)))

    def query(self) -> str:
        """Return the query of a link that opens what is shown.

        Raises:
            GraspPlannerError: If a link can't hold it.
        """
        return state_query(self._session.grasp, *self._search)

    def show(self, options: PlannerOptions, seed: int, count: int) -> None:
        """Show the command and the Python that plan the problem shown."""
        problem, search = self._session.problem, (options, seed, count)
        if self._told is problem and self._search == search:
            return  # while the hand is moved, nothing here changes, and writing it takes as long as drawing the hand
        self._told, self._search = problem, search
        lost = what_is_lost(problem)
        note = f"*Not in it: {lost}.*\n\n" if lost else ""
        texts = command_text(problem, options, seed, count), python_text(problem, seed, count)
        self._same.content = note + "\n\n".join(f"```\n{each}\n```" for each in texts)

    def open_bytes(self, content: bytes) -> None:
        """Show the grasp of an uploaded file; the file's name is of no interest.

        Args:
            content: What the file holds.

        Raises:
            GraspPlannerError: If it is too large, no JSON, breaks the contract or names what does not exist.
        """
        record, own = parse_grasp_record(content, "the uploaded file"), self._session.problem
        allowed = "an object without a file, or that shown; the command line opens files that name others"
        if record.object.partition(":")[0] == "mesh" and record.object != own.grasp_object.text:
            raise InvalidValueError("object", record.object, allowed)
        if record.hand != own.hand.name and record.hand not in hand_library():
            raise InvalidValueError("hand", record.hand, "a hand of the package, or that shown")
        hand = own.hand if record.hand == own.hand.name else load_hand(record.hand)
        grasp = grasp_from_record(record, hand)
        self._session.show(grasp, "opened from a file")

    def _open(self, client: viser.ClientHandle | None, content: bytes) -> None:
        """Have the worker open an upload; say what is wrong with it where it came from."""

        def work() -> None:
            try:
                self.open_bytes(content)
            except (GraspPlannerError, FileFormatError) as error:
                self.last_error = str(error)
                if client is not None:
                    client.add_notification("Not a grasp file", str(error)[:300], color="red")

        self._later(work)

    def _copy(self, client: viser.ClientHandle | None, what: str) -> None:
        """Have the worker put a link, the command or the Python on the clipboard of whoever asked for it."""
        if client is None:
            return
        page = client

        def work() -> None:
            options, seed, count = self._search
            problem = self._session.problem
            if what == LINK:
                copy_link(page, self.query())
            elif what == COMMAND:
                copy_text(page, command_text(problem, options, seed, count))
            else:
                copy_text(page, python_text(problem, seed, count))

        self._later(work)

    def _json(self) -> bytes:
        """Return the grasp as JSON."""
        return grasp_json(self._session.grasp).encode()

    def _html(self) -> bytes:
        """Return the grasp as a page of its own."""
        return grasp_html(self._session.grasp).encode()

    def _send(self, client: viser.ClientHandle | None, name: str, make: Callable[[], bytes]) -> None:
        """Have the worker make a file and send it to whoever asked for it."""
        if client is not None:
            self._later(lambda: client.send_file_download(name, make(), save_immediately=True))

    def _picture(self, client: viser.ClientHandle | None) -> None:
        """Render the view of whoever asked and send it there; in the callback's thread, as it waits for them."""
        if client is None:
            return
        from PIL import Image

        camera = client.camera
        height, width = PICTURE_SIZE
        pixels = client.get_render(
            height,
            width,
            wxyz=camera.wxyz,
            position=camera.position,
            fov=camera.fov,
            transport_format="png",
            timeout=60.0,
        )
        buffer = io.BytesIO()
        Image.fromarray(on_white(pixels)).save(buffer, format="PNG")
        client.send_file_download("grasp.png", buffer.getvalue(), save_immediately=True)


def on_white(pixels: np.ndarray) -> np.ndarray:
    """Return an RGBA picture on a white ground, as RGB."""
    if pixels.shape[2] == 3:
        return pixels
    alpha = pixels[..., 3:].astype(float) / 255.0
    return (pixels[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype(np.uint8)
