"""A client that speaks the protocol of viser 1.1 without a browser: what a page, or an attacker, could send."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec
import viser
import zstandard
from websockets.sync.client import connect

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class ProtocolClient:
    """Connects, keeps widgets and scene nodes up to date, sends messages.

    Attributes:
        widgets: Creation messages of all widgets by id, with updates applied.
        nodes: Creation messages of all scene nodes by name, with updates applied.
        kinds: Types of all messages received.
    """

    def __init__(self, port: int, origin: str | None = None) -> None:
        self.widgets: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.kinds: list[str] = []
        self._lock = threading.Lock()
        self._socket = connect(
            f"ws://127.0.0.1:{port}/",
            subprotocols=[f"viser-v{viser.__version__}"],
            origin=origin,
            max_size=None,
        )
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()
        self.send(**CAMERA)

    def __enter__(self) -> ProtocolClient:
        self.until(lambda: "ReplayDoneMessage" in self.kinds)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect."""
        self._socket.close()
        self._thread.join(timeout=5.0)

    def send(self, **message: Any) -> None:
        """Send a message."""
        self._socket.send(msgspec.msgpack.encode(message))

    def widget(self, label: str) -> dict[str, Any]:
        """Return a widget by its label."""
        with self._lock:
            return next(entry for entry in self.widgets.values() if entry["props"].get("label") == label)

    def set(self, label: str, value: Any) -> None:
        """Send a value for a widget, whatever it is."""
        self.send(type="GuiUpdateMessage", uuid=self.widget(label)["uuid"], updates={"value": value})

    def until(self, condition: Callable[[], Any], timeout_s: float = 15.0) -> Any:
        """Wait until a condition holds and return its value."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            with self._lock:
                value = condition()
            if value:
                return value
            time.sleep(0.005)
        raise TimeoutError("the condition did not come true")

    def _receive(self) -> None:
        """Take in messages until the connection ends."""
        try:
            for raw in self._socket:
                size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
                data = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
                with self._lock:
                    for message in msgspec.msgpack.decode(data)["messages"]:
                        self._apply(message)
        except Exception as error:
            self.error = error

    def _apply(self, message: dict[str, Any]) -> None:
        """Apply a message."""
        kind = message["type"]
        self.kinds.append(kind)
        if kind == "GuiUpdateMessage" and message["uuid"] in self.widgets:
            entry = self.widgets[message["uuid"]]
            for key, value in message["updates"].items():
                (entry if key == "value" else entry["props"])[key] = value
        elif kind == "GuiRemoveMessage":
            self.widgets.pop(message["uuid"], None)
        elif kind.startswith("Gui") and "props" in message and "uuid" in message:
            self.widgets[message["uuid"]] = message
        elif kind == "RemoveSceneNodeMessage":
            gone = message["name"]
            self.nodes = {n: m for n, m in self.nodes.items() if n != gone and not n.startswith(gone + "/")}
        elif kind == "SceneNodeUpdateMessage" and message["name"] in self.nodes:
            self.nodes[message["name"]]["props"].update(message["updates"])
        elif "name" in message and "props" in message:
            self.nodes[message["name"]] = message
        elif message.get("name") in self.nodes:
            self.nodes[message["name"]].update({k: v for k, v in message.items() if k not in ("type", "name")})
