"""The web server of the viewer: loopback by default, no foreign pages, no sharing, every incoming value checked."""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import io
import logging
import re
import secrets
import threading
from collections.abc import Awaitable, Callable, Iterator
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import viser
import websockets.asyncio.server as websocket_server
from viser import _messages as messages

from ..exceptions import InvalidValueError
from ..records.grasp_files import MAX_RECORD_BYTES
from .widget_values import in_bounds

LOOPBACK = ("127.0.0.1", "localhost", "::1")
MAX_UPLOADS = 4
"""Most uploads under way at once."""
MAX_PARTS = 64
"""Most parts of one upload."""

_patching = threading.Lock()


class LocalServer(viser.ViserServer):
    """A viser server that only its own page may talk to.

    A page of another origin gets HTTP 403 at the websocket. The public sharing tunnel can't be opened.
    Widget values are cut to the range of their widget before anyone sees them; uploads are limited in size.

    Attributes:
        upload_limits: Largest upload of a button [bytes], by its id; that of a grasp file where it is not here.
        page_asked: Called with the query of the address (such as ``?row=3``) when a person opens the page, empty for
            none; from the thread of the network.
    """

    def __init__(
        self, *, host: str = "127.0.0.1", port: int = 0, allow_remote: bool = False, token: bool = False
    ) -> None:
        """Start the server.

        Args:
            host: Address to listen on.
            port: Port, or 0 for any; the next free one if it is taken.
            allow_remote: Whether addresses other than loopback are allowed.
            token: Whether only who knows the address with its token gets the page; always so off loopback.

        Raises:
            InvalidValueError: If the address is not loopback and that was not allowed.
        """
        if host not in LOOPBACK and not allow_remote:
            raise InvalidValueError("host", host, "127.0.0.1 unless --allow-remote is given")
        hosts = [*LOOPBACK, host]
        self.page_asked: Callable[[dict[str, str]], None] = lambda _: None
        self.upload_limits: dict[str, int] = {}
        self._corrected: set[str] = set()
        self.token = secrets.token_urlsafe(24) if token or host not in LOOPBACK else ""
        any_host = host in ("0.0.0.0", "::")
        checked = _checked_requests(hosts, any_host=any_host, token=self.token, opened=self._opened)
        with checked, contextlib.redirect_stdout(io.StringIO()):
            super().__init__(host=host, port=port, label="Grasp viewer", verbose=False)
        self._guard()
        self.set_dark(False)

    @property
    def url(self) -> str:
        """Address of the page."""
        host = self.get_host()
        address = f"http://{'127.0.0.1' if host in ('0.0.0.0', '::') else host}:{self.get_port()}"
        return f"{address}/?token={self.token}" if self.token else address

    def set_dark(self, dark: bool) -> None:
        """Show the page light on dark, or dark on light."""
        self.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large", dark_mode=dark)

    def show_used_values(self) -> None:
        """Have every page show the values in use where something else was typed, such as a number beyond its range."""
        while self._corrected:
            uuid = self._corrected.pop()
            handle: Any = self.gui._gui_input_handle_from_uuid.get(uuid)
            if handle is not None:
                self.gui._websock_interface.queue_message(messages.GuiUpdateMessage(uuid, {"value": handle.value}))

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse to open a public tunnel."""
        return None

    def stop(self) -> None:
        """Stop without a word on the terminal."""
        with contextlib.redirect_stdout(io.StringIO()):
            super().stop()

    def _opened(self, request: Any) -> None:
        """Pass on the query of a page that a person opens; not of what another page fetches or embeds."""
        address = urlsplit(request.path)
        navigation = request.headers.get("Sec-Fetch-Mode"), request.headers.get("Sec-Fetch-Dest")
        if address.path == "/" and navigation == ("navigate", "document"):
            # The line of a request has 8 kB at most; a link that were cut would mean something else.
            query = dict(parse_qsl(address.query, keep_blank_values=True))
            query.pop("token", None)
            self.page_asked(query)

    def _guard(self) -> None:
        """Put checks in front of the handlers of everything that a page can send."""
        handlers = self._websock_server._incoming_handlers
        handlers.pop(messages.ShareUrlRequest, None)
        handlers.pop(messages.ShareUrlDisconnect, None)
        self._replace(messages.GuiUpdateMessage, self._checked_update)
        self._replace(messages.FileTransferStartUpload, self._checked_upload)
        self._replace(messages.FileTransferPart, self._checked_part)

    def _replace(self, kind: type, check: Callable[[Any], bool]) -> None:
        """Let messages of a kind reach their handlers only if a check passes."""
        handlers = self._websock_server._incoming_handlers
        inner = list(handlers[kind])

        async def handle(client_id: Any, message: Any) -> None:
            if not check(message):
                if kind is messages.FileTransferStartUpload:
                    self._say_refused(client_id, message)
                return
            for handler in inner:
                result = handler(client_id, message)
                if inspect.isawaitable(result):
                    await _wait(result)

        handlers[kind] = [handle]

    def _checked_update(self, message: Any) -> bool:
        """Cut the value of a widget to its range; return whether there is anything left to do."""
        handle: Any = self.gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is None or set(message.updates) != {"value"} or getattr(handle, "disabled", False):
            return False
        try:
            used = in_bounds(handle, message.updates["value"])
            given = message.updates["value"]
            if used != (tuple(given) if isinstance(given, list) else given):
                self._corrected.add(message.uuid)
            message.updates["value"] = used
        except (TypeError, ValueError, OverflowError):
            return False
        return True

    def _checked_upload(self, message: Any) -> bool:
        """Return whether an upload may begin."""
        size, parts = message.size_bytes, message.part_count
        if not (isinstance(size, int) and isinstance(parts, int)):
            return False
        under_way = len(self.gui._current_file_upload_states)
        return 0 <= size <= self._limit(message) and 0 <= parts <= MAX_PARTS and under_way < MAX_UPLOADS

    def _limit(self, message: Any) -> int:
        """Return the largest upload of the button that a message is about [bytes]."""
        return self.upload_limits.get(message.source_component_uuid, MAX_RECORD_BYTES)

    def _say_refused(self, client_id: Any, message: Any) -> None:
        """Tell who began an upload why it goes nowhere."""
        client = self.get_clients().get(client_id)
        if client is not None:
            text = f"At most {self._limit(message) // 1_000_000} MB, and {MAX_UPLOADS} files at once."
            client.add_notification("The upload is refused", text, color="red")

    def _checked_part(self, message: Any) -> bool:
        """Return whether a part fits into its upload; drops the upload if not."""
        state: Any = self.gui._current_file_upload_states.get(message.transfer_uuid)
        if state is None or not isinstance(message.content, bytes):
            return False
        if state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            self.gui._current_file_upload_states.pop(message.transfer_uuid, None)
            return False
        return True


async def _wait(result: Awaitable[Any]) -> None:
    """Wait for a handler."""
    await result


@contextlib.contextmanager
def _checked_requests(hosts: list[str], *, any_host: bool, token: str, opened: Callable[[Any], None]) -> Iterator[None]:
    """Make websocket servers created meanwhile refuse what is not from their own page, and report opened pages.

    Refused with HTTP 403 are other names of this machine (a foreign name that resolves to it makes a foreign page look
    like the own one), pages of other origins, and, if there is a token, who does not know it.
    """
    names = "|".join(re.escape(f"[{host}]" if ":" in host else host) for host in hosts)
    # On all interfaces the names of the machine are not known; the page's origin has to be the host it asked for.
    pattern = re.compile(r"https?://[^/]+" if any_host else rf"https?://({names})(:\d+)?")
    with _patching:
        original = websocket_server.serve

        def serve(handler: Any, *args: Any, process_request: Any = None, **kwargs: Any) -> Any:
            async def guarded(connection: Any) -> None:
                try:
                    await handler(connection)
                except Exception:  # bytes that are no message fail in many ways
                    await connection.close(1003, "not understood")

            def check(connection: Any, request: Any) -> Any:
                if not any_host and _host_name(request) not in hosts:
                    return connection.respond(403, "foreign host\n")
                if token and not _knows(request, token):
                    return connection.respond(403, "the token of the address is missing\n")
                origin = request.headers.get("Origin")
                if origin is not None and urlsplit(origin).netloc != request.headers.get("Host"):
                    return connection.respond(403, "foreign origin\n")
                if request.headers.get("Upgrade") is None:
                    opened(request)
                response = process_request(connection, request) if process_request is not None else None
                if token and response is not None:
                    cookie = f"{_cookie_name(token)}={token}; HttpOnly; SameSite=Lax; Path=/"
                    response.headers["Set-Cookie"] = cookie
                return response

            # What strangers send is no matter for the terminal; who logs sees it.
            logger = logging.getLogger("grasp_planner.viewer.network")
            logger.addHandler(logging.NullHandler())
            kwargs |= {"process_request": check, "origins": [pattern, None], "logger": logger}
            return original(guarded, *args, **kwargs)

        websocket_server.serve = serve  # type: ignore[misc,assignment]
        try:
            yield
        finally:
            websocket_server.serve = original  # type: ignore[misc]


def _host_name(request: Any) -> str:
    """Return the name by which a request calls this machine; empty if it is none."""
    try:
        return urlsplit(f"//{request.headers.get('Host', '')}").hostname or ""
    except ValueError:
        return ""


def _cookie_name(token: str) -> str:
    """Return the name of the cookie of a token: viewers of one machine share its cookies."""
    return f"grasp_viewer_{hashlib.sha256(token.encode()).hexdigest()[:12]}"


def _knows(request: Any, token: str) -> bool:
    """Return whether a request has the token, in its address or its cookie."""
    given = [value for key, value in parse_qsl(urlsplit(request.path).query) if key == "token"]
    with contextlib.suppress(CookieError):
        for text in request.headers.get_all("Cookie"):
            found = SimpleCookie(text).get(_cookie_name(token))
            given += [found.value] if found is not None else []
    return any(secrets.compare_digest(value.encode(), token.encode()) for value in given)
