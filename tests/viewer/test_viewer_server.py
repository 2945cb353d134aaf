"""The server against what pages and attackers can send, and several browsers at once: on the wire, no browser."""

import contextlib
import http.client
import json
import socket
import time

import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import grasp_planner as gp
from grasp_planner.viewer import widget_values
from grasp_planner.viewer.server import LocalServer

from .protocol_client import ProtocolClient

EVIL = "http://evil.example"


def shake_hands(port, origin=None, query="", cookie=None):
    """Open and close a websocket as a page of some origin would."""
    headers = {"Cookie": cookie} if cookie else None
    with connect(
        f"ws://127.0.0.1:{port}/{query}",
        subprotocols=[f"viser-v{viser.__version__}"],
        origin=origin,
        additional_headers=headers,
        max_size=None,
    ):
        pass


@pytest.mark.parametrize(
    "origin", [EVIL, "https://127.0.0.1.evil.example", "http://localhost.evil.example:8080", "null", "http://10.0.0.1"]
)
def test_pages_of_other_origins_get_403(viewer, origin):
    with pytest.raises(InvalidStatus) as refused:
        shake_hands(viewer.server.get_port(), origin)
    assert refused.value.response.status_code == 403


def test_a_page_of_another_port_of_this_machine_gets_403(viewer):
    with pytest.raises(InvalidStatus) as refused:
        shake_hands(viewer.server.get_port(), "http://127.0.0.1:1")
    assert refused.value.response.status_code == 403


def test_the_own_page_may_connect(viewer):
    shake_hands(viewer.server.get_port(), viewer.url)


def test_the_server_listens_on_loopback_only(viewer):
    assert viewer.server.get_host() == "127.0.0.1"
    with pytest.raises(gp.InvalidValueError, match="allow-remote"):
        LocalServer(host="0.0.0.0")


def test_on_all_interfaces_foreign_origins_are_still_refused():
    server = LocalServer(host="0.0.0.0", allow_remote=True)
    try:
        own = f"http://127.0.0.1:{server.get_port()}"
        with pytest.raises(InvalidStatus):
            shake_hands(server.get_port(), EVIL, query=f"?token={server.token}")
        with pytest.raises(InvalidStatus) as refused:
            shake_hands(server.get_port(), own)
        assert refused.value.response.status_code == 403, "off loopback there is always a token"
        shake_hands(server.get_port(), own, query=f"?token={server.token}")
    finally:
        server.stop()


def test_files_outside_the_page_are_not_served(viewer):
    for path in ("/../../../../etc/passwd", "/%2e%2e/%2e%2e/%2e%2e/etc/passwd", "/../_viser.py"):
        connection = http.client.HTTPConnection("127.0.0.1", viewer.server.get_port(), timeout=10)
        connection.request("GET", path)
        assert connection.getresponse().status == 404
        connection.close()


def test_the_public_tunnel_can_not_be_opened(viewer, client, monkeypatch):
    opened = []
    monkeypatch.setattr(viser._viser, "ViserTunnel", lambda *args: opened.append(args))
    client.send(type="ShareUrlRequest")
    client.send(type="ShareUrlDisconnect")
    client.set("σ1", 0.25)
    client.until(lambda: viewer.session.live.sigma[0] == 0.25)
    assert not opened
    assert viewer.server.request_share_url() is None


def test_huge_and_malformed_values_are_cut_or_dropped(viewer, client):
    slider = viewer.synergies.sliders[0]
    before = slider.value
    for bad in (float("nan"), float("inf"), "abc", None, [1, 2], True, {"a": 1}):
        client.set("σ1", bad)
    client.set("σ1", 1e9)
    client.until(lambda: slider.value != before)
    assert slider.value == slider.max
    client.set("σ1", -1e9)
    client.until(lambda: slider.value == slider.min)
    viewer.worker.drain()
    assert np.isfinite(viewer.session.grasp.joint_angles).all()


def test_dropdowns_take_their_options_only(viewer, client):
    client.set("Kind", "sabotage")
    client.set("Kind", "torque")
    client.until(lambda: viewer.session.problem.tasks[0].kind == "torque")
    assert not viewer.share.last_error


def test_other_properties_of_widgets_can_not_be_set_from_a_page(viewer, client):
    client.send(type="GuiUpdateMessage", uuid=client.widget("σ1")["uuid"], updates={"max": 1e9, "value": 0.1})
    client.send(type="GuiUpdateMessage", uuid="no such widget", updates={"value": 0.1})
    client.set("σ2", 0.123)
    client.until(lambda: viewer.session.live.sigma[1] == 0.123)
    assert viewer.synergies.sliders[0].max < 10.0


def test_long_texts_are_cut(viewer, client):
    client.set("More tasks", "x" * 100_000)
    client.until(lambda: viewer.problem.more.value.startswith("x") or viewer.share.last_error)
    viewer.worker.drain()
    assert len(viewer.share.last_error) < 2 * widget_values.MAX_TEXT
    assert len(viewer.problem.more.value) <= widget_values.MAX_TEXT


def test_disabled_buttons_can_not_be_pressed(viewer, client):
    client.set("Cancel", True)
    client.set("σ1", 0.3)
    client.until(lambda: viewer.session.live.sigma[0] == 0.3)
    assert not viewer.planning.busy


def upload(client, content, *, claimed=None, name="../../grasp.json"):
    uuid = client.widget("Open a grasp (JSON)")["uuid"]
    size = len(content) if claimed is None else claimed
    client.send(
        type="FileTransferStartUpload",
        source_component_uuid=uuid,
        transfer_uuid=name,
        filename=name,
        mime_type="application/json",
        part_count=1,
        size_bytes=size,
    )
    client.send(type="FileTransferPart", source_component_uuid=uuid, transfer_uuid=name, part_index=0, content=content)


def test_an_upload_is_shown(viewer, client):
    upload(client, viewer.share._json())
    client.until(lambda: viewer.session.note == "opened from a file")


def test_a_bad_upload_gives_a_message_to_whoever_sent_it(viewer, client):
    upload(client, b'{"hand": 1}')
    client.until(lambda: "Notification" in " ".join(client.kinds))
    assert "the uploaded file" in viewer.share.last_error


def test_uploads_too_large_are_not_even_stored(viewer, client):
    states = viewer.server.gui._current_file_upload_states
    upload(client, b"x", claimed=10**9, name="claimed")
    upload(client, b"x" * 6_000_000, claimed=10, name="hidden")
    client.set("σ1", 0.31)
    client.until(lambda: viewer.session.live.sigma[0] == 0.31)
    assert not states


def test_two_browsers_see_the_same(viewer):
    port = viewer.server.get_port()
    with ProtocolClient(port) as one, ProtocolClient(port) as two:
        one.set("σ1", 0.45)
        two.until(lambda: any(w.get("value") == 0.45 for w in two.widgets.values()))
        two.until(lambda: "data-model='broken'" in str([w["props"].get("content", "") for w in two.widgets.values()]))


@pytest.mark.slow
def test_twenty_browsers_are_served(viewer):
    port = viewer.server.get_port()
    clients = [ProtocolClient(port).__enter__() for _ in range(20)]
    try:
        durations = []
        for step in range(15):
            value = 0.2 + 0.01 * step
            began = time.perf_counter()
            clients[0].set("σ1", value)
            clients[0].until(lambda value=value: viewer.session.live.sigma[0] == value)
            viewer.worker.drain()
            durations.append(time.perf_counter() - began)
        assert np.median(durations) < 3.0
    finally:
        for client in clients:
            client.close()


def test_clipping_covers_every_widget_of_the_page(viewer):
    """No widget accepts a value of a wrong kind."""
    for handle in viewer.server.gui._gui_input_handle_from_uuid.values():
        if not isinstance(handle.value, bool | int | float | str | tuple):
            continue
        with pytest.raises((TypeError, ValueError)):
            widget_values.in_bounds(handle, {"a": 1})
        if isinstance(handle.value, float) and hasattr(handle, "max") and handle.max is not None:
            assert widget_values.in_bounds(handle, 1e300) <= handle.max


def page(port, path="/", **headers):
    """Ask for the page; return status and cookie."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    response = connection.getresponse()
    response.read()
    connection.close()
    return response.status, response.getheader("Set-Cookie")


def test_the_page_needs_the_token_and_then_its_cookie_is_enough():
    server = LocalServer(token=True)
    try:
        port, name = server.get_port(), f"?token={server.token}"
        assert server.url.endswith(name) and len(server.token) >= 32
        for path in ("/", "/?token=", "/?token=x", f"/?token={server.token}x", "/?Token=" + server.token):
            assert page(port, path)[0] == 403
        status, cookie = page(port, "/" + name)
        assert status == 200 and "HttpOnly" in cookie and "SameSite" in cookie
        assert page(port, Cookie=cookie.split(";")[0])[0] == 200
        assert page(port, Cookie=cookie.split("=")[0] + "=x")[0] == 403
        shake_hands(port, f"http://127.0.0.1:{port}", cookie=cookie.split(";")[0])
        with pytest.raises(InvalidStatus):
            shake_hands(port, f"http://127.0.0.1:{port}")
    finally:
        server.stop()


def test_on_loopback_the_page_needs_no_token_unless_asked_for(viewer):
    assert viewer.server.token == "" and page(viewer.server.get_port())[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "", "[", "10.0.0.1"])
def test_foreign_names_of_this_machine_get_403(viewer, host):
    assert page(viewer.server.get_port(), Host=host)[0] == 403
    assert page(viewer.server.get_port(), Host="localhost:1")[0] == 200


@pytest.mark.parametrize("frame", ["text", b"", b"\xc1", b"\x93\x01\x02", b"\x81\xa4type\xa4Nope", b"\x80"])
def test_frames_that_are_no_message_close_the_connection_and_nothing_else(viewer, client, frame, capfd):
    port = viewer.server.get_port()
    with connect(f"ws://127.0.0.1:{port}/", subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as socket:
        socket.send(frame)
        with pytest.raises(ConnectionClosed) as closed:
            while True:
                socket.recv(timeout=10)
    assert closed.value.rcvd.code == 1003
    assert "Traceback" not in capfd.readouterr().err
    shake_hands(port, viewer.url)


@pytest.mark.parametrize(
    "data", [b"hello\r\n\r\n", b"\x16\x03\x01\x00", b"GET / HTTP/9.9\r\n\r\n", b"GET /" + b"x" * 9999]
)
def test_bytes_that_are_no_request_print_nothing(viewer, data, capfd):
    with socket.create_connection(("127.0.0.1", viewer.server.get_port()), timeout=10) as link:
        link.sendall(data)
        link.shutdown(socket.SHUT_WR)
        with contextlib.suppress(OSError):
            while link.recv(4096):
                pass
    assert page(viewer.server.get_port())[0] == 200
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("key", "value"),
    [("object", "mesh:/etc/passwd.stl"), ("object", "mesh:a.stl"), ("hand", "/etc/passwd"), ("hand", "a/b.toml")],
)
def test_files_named_in_an_upload_are_not_opened(viewer, grasp, key, value):
    record = json.loads(gp.grasp_json(grasp))
    record[key] = value
    with pytest.raises(gp.InvalidValueError, match=key):
        viewer.share.open_bytes(json.dumps(record).encode())
