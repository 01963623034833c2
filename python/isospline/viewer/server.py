"""The web server of a viewer: the page, and a socket for each window. It decides who may connect."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import hmac
import http
import ipaddress
import json
import secrets
import threading
import urllib.parse
from pathlib import Path
from typing import Any

from ..parameters import check_type

PAGE = Path(__file__).parent / "page"
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
#: Bytes of the longest message of a page: a part of an upload.
LONGEST_MESSAGE = 1 << 22
#: Seconds that a window has to answer when the server closes; a page that hangs must not delay the end of the program.
CLOSE_TIMEOUT = 2


class Server:
    """Serves the page and its sockets on its own thread.

    Requests must name the server by one of its addresses. Otherwise, a page of another origin could reach the server
    under the page's own domain name (DNS rebinding). Only the server's own pages may open sockets. If the server
    listens to other machines, a socket needs the token, which is a part of `url`.

    Parameters
    ----------
    viewer : Viewer
    host : str
        The address to listen on.
    port : int
        0 takes any free port.
    token : str, optional
        By default, a random one if other machines can connect to the host.

    Raises
    ------
    OSError
        If the server cannot listen on the address.
    """

    def __init__(self, viewer, host, port, token=None):
        check_type(host, "host", str, "a str")
        check_type(port, "port", int, "a whole number")
        check_type(token, "token", (str, type(None)), "a str or None")
        if not 0 <= port <= 65535:
            raise ValueError(f"port: expected 0 to 65535, got {port}")
        try:
            import websockets.asyncio.server as sockets
        except ImportError as error:
            message = "the viewer needs the package websockets 13 or later: pip install isospline[view]"
            raise ImportError(message) from error
        self._sockets, self._viewer = sockets, viewer
        self._host, self._token = host, token or (None if is_local(host) else secrets.token_urlsafe(16))
        self._loop = asyncio.new_event_loop()
        self._stopping: Any = None  # an event of the loop
        self._failure = None
        self.port = port
        started = threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(host, port, started), name="isospline-server", daemon=True
        )
        self._thread.start()
        started.wait()
        if self._failure is not None:
            raise self._failure

    @property
    def url(self):
        """The address of the page, with the token if there is one."""
        everywhere = self._host in ("", "0.0.0.0", "::")
        name = "127.0.0.1" if everywhere else f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{name}:{self.port}/" + (f"?token={self._token}" if self._token else "")

    def close(self):
        """Stop listening, and close all sockets."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._stopping.set)
        self._thread.join()

    def _run(self, host, port, started):
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve(host, port, started))
        except OSError as error:
            reason = error.strerror or str(error)
            message = f"port: expected a free port at {host or '*'}, got {port}: {reason}"
            self._failure = OSError(error.errno, message)
        except Exception as error:
            self._failure = error
        finally:
            started.set()
            self._loop.close()

    async def _serve(self, host, port, started):
        self._stopping = asyncio.Event()
        async with self._sockets.serve(
            self._connect,
            host,
            port,
            process_request=self._answer,
            max_size=LONGEST_MESSAGE,
            compression=None,
            close_timeout=CLOSE_TIMEOUT,
        ) as server:
            self.port = server.sockets[0].getsockname()[1]
            started.set()
            await self._stopping.wait()
            server.close(close_connections=True)

    def _answer(self, connection, request):
        """Answer a request for a file; None lets a socket open."""
        host = request.headers.get("Host", "")
        if not self._is_own(host):
            return connection.respond(http.HTTPStatus.FORBIDDEN, "This address is not the viewer's.\n")
        url = urllib.parse.urlsplit(request.path)
        if url.path == "/socket":
            origin = request.headers.get("Origin")
            if origin not in (f"http://{host}", f"https://{host}"):
                return connection.respond(http.HTTPStatus.FORBIDDEN, "Pages of other origins may not connect.\n")
            given = urllib.parse.parse_qs(url.query).get("token", [""])[0]
            if self._token and not hmac.compare_digest(given.encode(), self._token.encode()):
                return connection.respond(http.HTTPStatus.FORBIDDEN, "The address lacks the token.\n")
            return None
        return self._file(connection, url.path)

    def _is_own(self, host):
        """Whether a request names this server by an address, or by the name that it listens on.

        Other names could be domains that an attacker points to this machine in order to read its pages.
        """
        with contextlib.suppress(ValueError):
            parts = urllib.parse.urlsplit(f"//{host}")
            name = parts.hostname or ""
            if name == "localhost" or name == self._host:
                return True
            address = ipaddress.ip_address(name)
            return bool(self._token) or address.is_loopback
        return False

    def _file(self, connection, path):
        files = page_files()
        name = path.lstrip("/") or "index.html"
        if name == "alive":
            return connection.respond(http.HTTPStatus.OK, "isospline\n")
        if name not in files:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "There is no such page.\n")
        response = connection.respond(http.HTTPStatus.OK, "")
        response.body = files[name]
        for header in ("Content-Type", "Content-Length"):
            del response.headers[header]
        response.headers["Content-Type"] = f"{TYPES[Path(name).suffix]}; charset=utf-8"
        response.headers["Content-Length"] = str(len(response.body))
        response.headers["Cache-Control"] = "no-store"
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Content-Security-Policy"] = (
            "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
            "frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:"
        )
        return response

    async def _connect(self, connection):
        """Serve one window until it is closed."""
        import websockets.exceptions

        from .window import Window

        outgoing: asyncio.Queue[str | bytes] = asyncio.Queue()

        def send(message):
            with contextlib.suppress(RuntimeError):  # the loop is closed, and the window with it
                self._loop.call_soon_threadsafe(outgoing.put_nowait, message)

        window = Window(self._viewer, send)
        sending = asyncio.ensure_future(_send_all(connection, outgoing))
        try:
            async for message in connection:
                window.receive(message if isinstance(message, bytes) else json.loads(message))
        except (websockets.exceptions.WebSocketException, ValueError, RecursionError):
            pass  # the page was closed, or is not one of ours
        finally:
            sending.cancel()
            await self._loop.run_in_executor(None, window.close)


async def _send_all(connection, outgoing):
    import websockets.exceptions

    with contextlib.suppress(websockets.exceptions.WebSocketException):
        while True:
            await connection.send(await outgoing.get())


@functools.cache
def page_files():
    """The files of the page by their names."""
    return {path.name: path.read_bytes() for path in PAGE.iterdir() if path.suffix in TYPES}


def is_local(host):
    """Whether only this machine can connect to an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
