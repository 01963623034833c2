"""Who can connect to a viewer: the token, its cookie, addresses, origins; and where the token never shows."""

import json
import logging
import os
import re
import subprocess
import sys
import threading

import pytest
import websockets.exceptions
from viewer_client import Client, connect, get, port_of, token_of

import isospline
from isospline.io import landlock
from isospline.viewer.cell import still
from isospline.viewer.viewer import Viewer
from isospline.viewer.widget import ViewerWidget

VARIABLE = "ISOSPLINE_TOKEN"


@pytest.fixture
def viewer(ball, monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    with isospline.view(ball, browser=False) as opened:
        yield opened


def cookie_of(headers):
    return headers["Set-Cookie"].split(";")[0]


def refused(viewer, **options):
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        connect(viewer, **options)


def test_files_of_the_page_and_no_others(viewer):
    page = f"/?token={token_of(viewer)}"
    for path, kind in {page: "text/html", "/main.js": "text/javascript", "/style.css": "text/css"}.items():
        status, body, headers = get(viewer, path)
        assert status == 200 and headers["Content-Type"].startswith(kind) and len(body) > 500
        assert "default-src 'self'" in headers["Content-Security-Policy"]
        assert headers["Referrer-Policy"] == "no-referrer" and headers["Cache-Control"] == "no-store"
        assert token_of(viewer).encode() not in body
    for path in ("/../server.py", "/%2e%2e/server.py", "/page/index.html", "//etc/passwd", "/server.py", "//", "/?/"):
        assert get(viewer, path)[0] in (403, 404)


def test_page_and_socket_need_the_token_on_loopback_too(viewer):
    token = token_of(viewer)
    assert re.fullmatch(r"[\w-]{32}", token)
    wrong = ("", "?token=", "?token=wrong", f"?token={token}x", f"?token={token[:-1]}", "?other=1", "?token=%ff")
    for query in wrong:
        for page in ("/", "/index.html"):
            status, body, headers = get(viewer, f"{page}{query}")
            assert status == 403 and b"token" in body and "Set-Cookie" not in headers
        refused(viewer, query=query)  # with the right Origin, which any program can send
    with connect(viewer):
        pass


def test_the_first_page_has_the_cookie(viewer):
    status, _, headers = get(viewer, f"/?token={token_of(viewer)}")
    name, *attributes = headers["Set-Cookie"].split("; ")
    assert status == 200 and set(attributes) == {"Path=/", "HttpOnly", "SameSite=Strict"}
    assert re.fullmatch(rf"isospline-{port_of(viewer)}=[\w-]{{24}}", name)
    assert token_of(viewer) not in name
    status, _, headers = get(viewer, cookie=f"other=1; {name}; {name}x")
    assert status == 200 and "Set-Cookie" not in headers
    with connect(viewer, query="", cookie=name):
        pass
    for cookie in ("", "isospline-1=a", name[:-1], f"{name}x", name.replace("isospline", "x"), f"a={name}", "=", ";;"):
        assert get(viewer, cookie=cookie)[0] == 403
        refused(viewer, query="", cookie=cookie)


def test_a_cookie_is_good_for_one_port_and_one_token(ball, viewer):
    cookie = cookie_of(get(viewer, f"/?token={token_of(viewer)}")[2])
    value = cookie.partition("=")[2]
    for token in (token_of(viewer), None):
        with isospline.view(ball, browser=False, token=token) as other:
            for given in (cookie, f"isospline-{port_of(other)}={value}"):
                assert get(other, cookie=given)[0] == 403
            # A viewer that is restarted with the same token and port continues with its pages.
            same = cookie_of(get(other, f"/?token={token_of(other)}")[2])
            port, token = port_of(other), token_of(other)
        with isospline.view(ball, browser=False, token=token, port=port) as again:
            assert get(again, cookie=same)[0] == 200


def test_pages_of_other_origins_are_refused(viewer):
    port = port_of(viewer)
    cookie = cookie_of(get(viewer, f"/?token={token_of(viewer)}")[2])
    for origin in ("http://evil.example", f"http://127.0.0.1:{port + 1}", f"http://localhost:{port}", "null", None):
        refused(viewer, origin=origin)
        refused(viewer, origin=origin, query="", cookie=cookie)  # as a browser would
    with connect(viewer, host="localhost"):
        pass


def test_other_names_for_this_machine_are_refused(viewer):
    """A page could point its own name to this machine, and would then have the same origin."""
    path = f"/?token={token_of(viewer)}"
    for host in ("evil.example", f"evil.example:{port_of(viewer)}", "192.0.2.1", "", "[", "127.0.0.1.evil.example"):
        assert get(viewer, path, host=host)[0] == 403
    assert get(viewer, path, host="localhost")[0] == 200


def test_no_other_page_has_the_page_in_a_frame(viewer):
    _, _, headers = get(viewer, f"/?token={token_of(viewer)}")
    assert headers["Content-Security-Policy"].endswith("frame-ancestors 'none'")


def test_a_viewer_for_other_machines_wants_its_token(ball):
    with isospline.view(ball, browser=False, host="0.0.0.0") as viewer:
        for query in ("", "?token=wrong"):
            refused(viewer, query=query)
        with connect(viewer):
            pass
        refused(viewer, origin="http://evil.example")


def test_tokens_are_compared_in_constant_time(viewer, monkeypatch):
    import isospline.viewer.access as access

    compared = []

    def compare(given, secret):
        compared.append(given)
        return False

    monkeypatch.setattr(access.hmac, "compare_digest", compare)
    assert get(viewer, f"/?token={token_of(viewer)}", cookie=f"isospline-{port_of(viewer)}=abc")[0] == 403
    assert {token_of(viewer).encode(), b"abc"} <= set(compared)


def test_tokens_of_the_user(ball, monkeypatch):
    monkeypatch.setenv(VARIABLE, "of-the/environment&=+%41")
    with isospline.view(ball, browser=False) as viewer:
        assert token_of(viewer) == "of-the/environment&=+%41"
        assert get(viewer, f"/?{viewer.url.split('?')[1]}")[0] == 200
        with connect(viewer):
            pass
    with isospline.view(ball, browser=False, token="of-the-call") as viewer:
        assert token_of(viewer) == "of-the-call"
        refused(viewer, query="?token=of-the/environment&=+%41")
    monkeypatch.setenv(VARIABLE, "")
    with isospline.view(ball, browser=False) as viewer:
        assert len(token_of(viewer)) == 32
    for token in ("", "pass word", "pass\nword", "pässword", "pass\ud800word"):
        with pytest.raises(ValueError, match="^token: expected ASCII") as caught:
            isospline.view(ball, browser=False, token=token)
        assert "word" not in str(caught.value)
    monkeypatch.setenv(VARIABLE, "pass word")
    with pytest.raises(ValueError, match=f"^{VARIABLE}: expected ASCII"):
        isospline.view(ball, browser=False)
    with pytest.raises(TypeError, match="^token: expected a str or None"):
        isospline.view(ball, browser=False, token=5)


@pytest.mark.slow
@pytest.mark.parametrize("how", ["option", "variable"])
def test_tokens_of_the_command_line(ball, how):
    options = ["--token", "of-the-user"] if how == "option" else []
    command = [sys.executable, "-m", "isospline", "view", str(ball), "--no-browser", *options]
    environment = {**os.environ, VARIABLE: "of-the-user" if how == "variable" else "another"}
    process = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    )
    try:
        assert process.stdout.readline().endswith("/?token=of-the-user\n")
    finally:
        process.terminate()
        _, errors = process.communicate(timeout=30)
    assert "of-the-user" not in errors


LOGGED = """
import logging, sys
logging.basicConfig(level=logging.DEBUG)
sys.path.insert(0, sys.argv[2])
import isospline
from viewer_client import Client, connect, get, port_of, token_of
viewer = isospline.view(sys.argv[1], browser=False)
logging.getLogger("websockets.client").setLevel(logging.ERROR)  # of this test
cookie = get(viewer, f"/?token={token_of(viewer)}")[2]["Set-Cookie"].split(";")[0]
get(viewer, cookie=cookie)
get(viewer, "/nothing?token=" + token_of(viewer))
client = Client(viewer)
client.receive("frame")
client.socket.send("no JSON")
client = Client(viewer, query="", cookie=cookie)
client.receive("frame")
import socket
page = f"/?token={token_of(viewer)}"
for line in (f"GET {page} HTTP/0.9", f"PUT {page} HTTP/1.1", f"GET {page}"):
    with socket.create_connection(("127.0.0.1", port_of(viewer))) as raw:
        raw.sendall(f"{line}\\r\\nCookie: {cookie}\\r\\n\\r\\n".encode())
        raw.recv(1000)
print(viewer)
viewer.close()
logging.debug("the end")
print("SECRETS", token_of(viewer), cookie.partition("=")[2])
"""


@pytest.mark.slow
def test_secrets_are_not_in_logs(ball):
    folder = os.path.dirname(os.path.dirname(__file__))
    environment = {**os.environ, "PYTHONASYNCIODEBUG": "1"}
    done = subprocess.run(
        [sys.executable, "-c", LOGGED, str(ball), folder],
        env=environment,
        capture_output=True,
        encoding="utf-8",
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    shown, _, secrets = done.stdout.partition("SECRETS")
    assert "the end" in done.stderr and "Viewer(http://127.0.0.1:" in shown
    for secret in secrets.split():
        assert secret not in done.stderr + shown


def test_secrets_are_not_in_files_and_messages(viewer, caplog):
    caplog.set_level(logging.DEBUG)
    token = token_of(viewer)
    cookie = cookie_of(get(viewer, f"/?token={token}")[2]).partition("=")[2]
    client = Client(viewer)
    client.receive("frame")
    for what in ("session", "python"):
        client.send(type="save", what=what)
        _, content = client.receive("file")
        assert len(content) > 100 and token.encode() not in content and cookie.encode() not in content
    for message in ({"type": token[:3]}, {"type": "save", "what": "nothing"}, {"type": "upload", "files": []}):
        client.send(**message)
        assert token not in json.dumps(client.receive("error"))
    assert token not in repr(viewer) and token not in str(viewer.state)
    client.close()


def test_what_notebooks_save_has_no_token(ball):
    """The state of widgets is saved with notebooks; the user's token may be good for other viewers as well."""
    with isospline.view(ball, browser=False, token="for-all-my-viewers") as viewer:
        widget = ViewerWidget(viewer, still(viewer), 300)
        assert "for-all-my-viewers" not in repr(widget.get_state())


def test_the_browser_is_not_given_the_token_in_its_arguments(ball, monkeypatch):
    """All users of a machine can read the arguments of programs."""
    import webbrowser

    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    with isospline.view(ball, browser=True) as viewer:
        (address,) = opened
        path = address.removeprefix("file://")
        assert address.startswith("file:///") and token_of(viewer) not in address
        assert os.stat(os.path.dirname(path)).st_mode & 0o777 == 0o700
        with open(path, encoding="utf-8") as file:
            assert viewer.url in file.read()
    assert not os.path.exists(path)


def test_many_wrong_requests_at_once(viewer):
    def ask():
        assert get(viewer, "/?token=wrong")[0] == 403

    threads = [threading.Thread(target=ask) for _ in range(30)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with connect(viewer):
        pass


# Files


def test_a_viewer_warns_once_of_what_does_not_confine_the_readers(monkeypatch):
    monkeypatch.setattr(landlock, "version", lambda: 0)
    with pytest.warns(UserWarning, match="without Landlock it can read and write your files") as caught, Viewer():
        pass
    assert len(caught) == 1
