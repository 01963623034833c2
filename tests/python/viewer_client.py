"""A window of the viewer without a page: what a test, or an attacker, sends and receives."""

import http.client
import json
import re
import time
import urllib.parse


def port_of(viewer):
    return int(re.search(r":(\d+)/", viewer.url).group(1))


def token_of(viewer):
    return urllib.parse.parse_qs(urllib.parse.urlsplit(viewer.url).query)["token"][0]


def get(viewer, path="/", host=None, cookie=None):
    """The status, the content and the headers of a page."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(viewer), timeout=10)
    connection.putrequest("GET", path, skip_host=True)
    connection.putheader("Host", f"127.0.0.1:{port_of(viewer)}" if host is None else host)
    if cookie is not None:
        connection.putheader("Cookie", cookie)
    connection.endheaders()
    answer = connection.getresponse()
    return answer.status, answer.read(), answer.headers


def connect(viewer, origin="own", query=None, host="127.0.0.1", cookie=None):
    """A socket; by default with the token."""
    import websockets.sync.client  # the viewer's tests need it, not those that only collect this file

    query = f"?{urllib.parse.urlsplit(viewer.url).query}" if query is None else query
    address = f"ws://{host}:{port_of(viewer)}/socket{query}"
    origin = f"http://{host}:{port_of(viewer)}" if origin == "own" else origin
    headers = {"Cookie": cookie} if cookie is not None else None
    return websockets.sync.client.connect(
        address, origin=origin, additional_headers=headers, open_timeout=10, close_timeout=2, max_size=2**28
    )


class Client:
    """A window without a page."""

    def __init__(self, viewer, **options):
        self.socket = connect(viewer, **options)
        self.send(type="hello", width=64, height=48)

    def send(self, **message):
        self.socket.send(json.dumps(message))

    def receive(self, *kinds, seconds=30):
        """The next message of one of some kinds; messages of other kinds are skipped."""
        end = time.monotonic() + seconds
        while True:
            message = self.socket.recv(timeout=max(0.01, end - time.monotonic()))
            if isinstance(message, bytes):
                size = int.from_bytes(message[:4], "little")
                about, content = json.loads(message[4 : 4 + size]), message[4 + size :]
                if about["type"] == "frame":
                    self.send(type="acknowledge")
            else:
                about, content = json.loads(message), None
            if about["type"] in kinds:
                return about, content

    def upload(self, files):
        """Upload contents by their names."""
        self.send(type="upload", files=[{"name": name, "size": len(content)} for name, content in files.items()])
        for content in files.values():
            for start in range(0, len(content), 1 << 20):
                self.socket.send(content[start : start + (1 << 20)])

    def uploaded(self, files):
        """Upload contents, and wait until they are open or refused; returns the texts of errors."""
        self.upload(files)
        errors = []
        while True:
            about, _ = self.receive("uploaded", "error")
            if about["type"] == "uploaded":
                return " ".join(errors)
            errors.append(about["text"])

    def close(self):
        self.socket.close()
