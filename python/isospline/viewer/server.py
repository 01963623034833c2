"""The web server of a viewer: the page, and a socket for each window. It decides who may connect."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import http
import logging
import threading
import urllib.parse
from pathlib import Path
from typing import Any

from ..base.parameters import check_type
from .access import Access

PAGE = Path(__file__).parent / "page"
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
#: Bytes of the longest message of a page: a part of an upload.
LONGEST_MESSAGE = 1 << 22
#: Seconds that a window has to answer when the server closes; a page that hangs must not delay the end of the program.
CLOSE_TIMEOUT = 2
#: The answer to a request for the page without a token.
WITHOUT_TOKEN = "This page needs the address that the viewer printed, with its token.\n"


class Server:
    """Serves the page and its sockets on its own thread, to those that `Access` lets in.

    The page and its socket need the token or the cookie; the scripts of the page are public and do not.

    Parameters
    ----------
    viewer : Viewer
    host : str
        The address to listen on.
    port : int
        0 takes any free port.
    token : str or None
        For None, that of the environment variable ISOSPLINE_TOKEN, or a random one.

    Raises
    ------
    OSError
        If the server cannot listen on the address.
    """

    def __init__(self, viewer, host, port, token):
        check_type(host, "host", str, "a str")
        check_type(port, "port", int, "a whole number")
        if not 0 <= port <= 65535:
            raise ValueError(f"port: expected 0 to 65535, got {port}")
        self._access = Access(host, token)
        try:
            import websockets.asyncio.server as sockets
        except ImportError as error:
            message = "the viewer needs the package websockets 13 or later: pip install isospline[view]"
            raise ImportError(message) from error
        self._sockets, self._viewer = sockets, viewer
        self._host = host
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
    def address(self):
        """The address of the server, without the token."""
        everywhere = self._host in ("", "0.0.0.0", "::")
        name = "127.0.0.1" if everywhere else f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{name}:{self.port}/"

    @property
    def url(self):
        """The address of the page, with the token."""
        return f"{self.address}?token={urllib.parse.quote(self._access.token, safe='')}"

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
            logger=_quiet_logger(),
        ) as server:
            self.port = server.sockets[0].getsockname()[1]
            started.set()
            await self._stopping.wait()
            server.close(close_connections=True)

    def _answer(self, connection, request):
        """Answer a request for a file; None lets a socket open."""
        host = _only(request.headers, "Host")
        if not self._access.is_own_address(host):
            return connection.respond(http.HTTPStatus.FORBIDDEN, "This address is not the viewer's.\n")
        path, _, query = request.path.partition("?")
        name = path[1:] or "index.html"
        if name == "socket" and not self._access.is_own_page(_only(request.headers, "Origin"), host):
            return connection.respond(http.HTTPStatus.FORBIDDEN, "Pages of other origins may not connect.\n")
        in_address = self._access.knows_token(query)
        if name in ("index.html", "socket"):
            known = in_address or self._access.has_cookie(request.headers.get_all("Cookie"), self.port)
            if not known:
                return connection.respond(http.HTTPStatus.FORBIDDEN, WITHOUT_TOKEN)
        return None if name == "socket" else self._file(connection, name, in_address)

    def _file(self, connection, name, in_address):
        files = page_files()
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
            "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; frame-ancestors 'none'"
        )
        if in_address:
            response.headers["Set-Cookie"] = self._access.set_cookie(self.port)
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
                window.receive(message)
        except (websockets.exceptions.WebSocketException, ValueError, RecursionError):
            pass  # the page was closed, or is not one of ours
        finally:
            sending.cancel()
            await self._loop.run_in_executor(None, window.close)


def _only(headers, name):
    """The value of a header that occurs once; otherwise an empty string."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else ""


def _quiet_logger():
    """A logger that never shows requests: their addresses and cookies open the viewer."""
    logger = logging.getLogger(__name__)
    logger.setLevel(logging.ERROR)
    if not logger.filters:
        logger.addFilter(lambda record: "handshake" not in record.getMessage())
    return logger


async def _send_all(connection, outgoing):
    import websockets.exceptions

    with contextlib.suppress(websockets.exceptions.WebSocketException):
        while True:
            await connection.send(await outgoing.get())


@functools.cache
def page_files():
    """The files of the page by their names."""
    return {path.name: path.read_bytes() for path in PAGE.iterdir() if path.suffix in TYPES}
