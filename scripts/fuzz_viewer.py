"""The viewer as doors of scripts/fuzz.py: requests, frames, values of widgets, uploads; one viewer for all."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import socket
import threading
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import viser
from fuzz_doors import ROOT, Door
from websockets.exceptions import ConnectionClosed, InvalidMessage
from websockets.sync.client import connect

from grasp_planner.exceptions import GraspPlannerError
from grasp_planner.viewer import GraspViewer, first_grasp

WAIT_S = 0.2
"""How long an answer to a frame is waited for [s]."""
_UNFORESEEN = re.compile(r"[A-Z][A-Za-z]*(?:Error|Exception|Warning): ")


class Watch:
    """A viewer, what its worker says went wrong, and what ended its threads."""

    def __init__(self) -> None:
        self.said: list[str] = []
        threading.excepthook = lambda args: self.said.append(f"{args.exc_type.__name__}: in a thread: {args.exc_value}")
        self.viewer = GraspViewer(first_grasp())
        inner = self.viewer.worker._on_error
        self.viewer.worker._on_error = lambda text: (self.said.append(text), inner(text))[1]
        self.port = self.viewer.server.get_port()

    def check(self) -> None:
        """Check that the viewer still serves and that nothing went wrong that nobody foresaw.

        Raises:
            GraspPlannerError: If the worker refused what was sent, as it may.
            AssertionError: If more than that went wrong.
        """
        self.viewer.planning.cancel()
        assert self.viewer.worker.drain(60.0), "the worker does not come to rest"
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200, "the page is not served any more"
        connection.close()
        said, self.said[:] = list(self.said), []
        assert not any(_UNFORESEEN.match(text) for text in said), str(said)[:300]
        if said:
            raise GraspPlannerError(said[0])


@cache
def watch() -> Watch:
    """Return the viewer, started once."""
    return Watch()


def _request(folder: Path) -> None:
    """Send bytes that may be a request."""
    with socket.create_connection(("127.0.0.1", watch().port), timeout=2.0) as link, contextlib.suppress(OSError):
        link.sendall((folder / "input").read_bytes())
        link.shutdown(socket.SHUT_WR)
        while link.recv(65536):
            pass
    watch().check()


def _frame(data: bytes | str) -> None:
    """Send one frame to the page's socket."""
    address, protocols = f"ws://127.0.0.1:{watch().port}/", [f"viser-v{viser.__version__}"]
    refused = contextlib.suppress(ConnectionClosed, InvalidMessage, TimeoutError, OSError)
    with refused, connect(address, subprotocols=protocols, max_size=None, close_timeout=1.0) as link:
        link.send(data)
        for _ in range(100):
            link.recv(timeout=WAIT_S)
    watch().check()


def _widget(folder: Path) -> None:
    """Send a value for a widget: a list of the widget's number and the value, as JSON, or a text for the first one."""
    data = (folder / "input").read_bytes()
    number, value = 0, data.decode(errors="replace")
    with contextlib.suppress(ValueError, RecursionError, TypeError):
        number, value = json.loads(data)
    uuids = sorted(watch().viewer.server.gui._gui_input_handle_from_uuid)
    uuid = uuids[number % len(uuids)] if isinstance(number, int) else str(number)
    message = {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}
    with contextlib.suppress(ValueError, OverflowError, TypeError):
        _frame(msgspec.msgpack.encode(message))


def _upload(folder: Path) -> None:
    """Open an upload as the page's worker does."""
    viewer = watch().viewer
    viewer.worker.submit(lambda: viewer.share.open_bytes((folder / "input").read_bytes()))
    watch().check()


def _messages() -> tuple[bytes, ...]:
    """Return messages that pages send, as frames."""
    camera = {"type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (1.0, 1.0, 1.0), "fov": 1.0}
    camera |= {"near": 0.01, "far": 100.0, "image_height": 600, "image_width": 800}
    camera |= {"look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0)}
    start = {"type": "FileTransferStartUpload", "source_component_uuid": "a", "transfer_uuid": "b", "filename": "c"}
    start |= {"mime_type": "application/json", "part_count": 1, "size_bytes": 10}
    part = {"type": "FileTransferPart", "source_component_uuid": "a", "transfer_uuid": "b", "part_index": 0}
    some: list[dict[str, Any]] = [camera, start, {**part, "content": b"x"}, {"type": "ShareUrlRequest"}]
    click = {"type": "SceneNodeClickMessage", "name": "/object", "instance_index": None, "ray_origin": (0.0, 0.0, 0.0)}
    some += [{**click, "ray_direction": (0.0, 0.0, 1.0), "screen_pos": (0.5, 0.5)}]
    some += [{"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": 1.0}}]
    return tuple(msgspec.msgpack.encode(message) for message in some)


def viewer_doors() -> list[Door]:
    """Return the doors of the viewer."""
    requests = (
        b"GET /?row=3&token=abc HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: a=b\r\nSec-Fetch-Mode: navigate\r\n"
        b"Sec-Fetch-Dest: document\r\nOrigin: http://127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n\x81\x85\x00\x00\x00\x00hello",
    )
    numbers = tuple(json.dumps([number, value]).encode() for number in range(60) for value in (0.5, "a", True, [1, 2]))
    grasps = tuple((ROOT / "tests" / "data" / f"{name}.json").read_bytes() for name in ("clear", "paper", "push"))

    def put(data: bytes, folder: Path) -> None:
        (folder / "input").write_bytes(data)

    return [
        Door("request", requests, put, _request),
        Door("frame", _messages(), put, lambda folder: _frame((folder / "input").read_bytes())),
        Door("widget", numbers, put, _widget),
        Door("upload", grasps, put, _upload),
    ]
