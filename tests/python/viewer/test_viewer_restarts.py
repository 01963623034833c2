"""The token of a page in Chromium, and pages whose viewer is restarted."""

import contextlib
import time

import numpy as np
import pytest
from browser import Page
from viewer_client import Client, port_of, token_of

import isospline

LEVEL = 0.0
SMALL = (460, 140)  # a window whose pictures are drawn soon


@pytest.fixture
def context(browser):
    opened = browser.new_context()
    yield opened
    opened.close()


@pytest.mark.slow
def test_the_cookie_replaces_the_token_in_the_address(context, large_ball):
    with isospline.view(large_ball, levels=[LEVEL], browser=False) as viewer:
        page = Page(context, viewer.url, SMALL)
        page.settle()
        (cookie,) = context.cookies()
        assert cookie["httpOnly"] and cookie["sameSite"] == "Strict" and str(port_of(viewer)) in cookie["name"]
        assert page.page.url == viewer.address and page.evaluate("document.cookie") == ""
        for _ in range(2):
            page.page.reload()
            page.settle()
        page.close()
        other = Page(context, viewer.address, SMALL)  # another window of the same browser
        other.settle()
        other.close()
        assert not page.problems + other.problems
        context.clear_cookies()
        assert context.request.get(viewer.address).status == 403


def test_the_file_that_leads_to_the_page_opens_it(context, large_ball, monkeypatch):
    """A file is another site. The page can be reloaded all the same."""
    import webbrowser

    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    with isospline.view(large_ball, levels=[LEVEL], browser=True) as viewer:
        page = Page(context, opened[0], SMALL)
        page.page.wait_for_url(viewer.address)
        page.settle()
        referrer = page.evaluate("document.referrer")
        page.page.reload()
        page.settle()
        page.close()
        assert not page.problems and referrer == ""


def test_the_token_is_in_no_request_to_others(context, large_ball):
    """Requests of the page have no Referer."""
    with isospline.view(large_ball, levels=[LEVEL], browser=False) as viewer:
        requests = []
        opened = context.new_page()
        opened.on("request", lambda request: requests.append((request.url, request.all_headers())))
        opened.goto(viewer.url)
        opened.wait_for_selector("#status:has-text('sample')")
        opened.evaluate("fetch('alive')")
        opened.wait_for_timeout(200)
        assert len(requests) > 5
        for url, headers in requests:
            assert token_of(viewer) not in headers.get("referer", "")
            assert (token_of(viewer) in url) == (url == viewer.url)
        opened.close()


def wait_for_level(page, level):
    end = time.monotonic() + 30
    while page.evaluate("isospline.state.objects[0]?.level") != level:
        assert time.monotonic() < end, page.messages()
        time.sleep(0.05)


@pytest.mark.slow
def test_a_page_continues_with_a_restarted_viewer(context, large_ball, tmp_path):
    """It says what is lost, and shows it again if the user wants it."""
    other = tmp_path / "other.npy"
    other.write_bytes(large_ball.read_bytes())
    with isospline.view(large_ball, levels=[LEVEL], browser=False, token="of-both") as viewer:
        # The page tries to connect again while no viewer is there, and Chromium reports every attempt as an error.
        page = Page(context, viewer.url, SMALL, expected=("ERR_CONNECTION_REFUSED",))
        page.settle()
        page.page.set_input_files("#open", other)
        page.wait("isospline.state.objects.length === 2")
        viewer.change(lambda state: state.with_object(0, level=5.0, color="#123456").replace(light="outline"))
        page.drag((300, 300), (380, 260))
        page.settle()
        camera, port = page.evaluate("isospline.camera"), port_of(viewer)
    page.wait("document.getElementById('messages').textContent.includes('is lost')")
    again = isospline.view(large_ball, levels=[3.0], browser=False, token="of-both", port=port)
    with contextlib.closing(page), again as viewer:
        wait_for_level(page, 3.0)  # what the user asked for now
        page.wait("document.getElementById('messages').textContent.includes('No longer open: other.npy.')")
        assert "is lost" not in page.messages()
        page.page.locator("#restore").click()
        wait_for_level(page, 5.0)
        page.settle()
        (each,) = viewer.state.objects
        assert each.color == "#123456" and viewer.state.light == "outline"
        assert page.evaluate("isospline.camera") == camera
        assert page.messages().strip() == "" and not page.problems


@pytest.mark.slow
def test_a_restarted_viewer_of_another_file_has_its_panel(context, large_ball, tmp_path):
    """The new source has the key of the one before."""
    other = tmp_path / "other.npy"
    np.save(other, 100 * np.load(large_ball))
    zoom = "document.querySelector('#histogram svg').dispatchEvent(new WheelEvent('wheel', {deltaY: -500}))"
    with isospline.view(large_ball, levels=[LEVEL], browser=False, token="of-both") as viewer:
        page = Page(context, viewer.url, SMALL, expected=("ERR_CONNECTION_REFUSED",))
        page.settle()
        viewer.change(lambda state: state.replace(slices=state.slices.replace(shown=True)))
        page.wait("isospline.state.slices.shown")
        page.evaluate(f"isospline.slices.zoomBy(4), {zoom}")
        assert "ball.npy" in page.evaluate("document.getElementById('objects').textContent")
        port = port_of(viewer)
    page.wait("document.getElementById('messages').textContent.includes('is lost')")
    again = isospline.view(other, levels=[LEVEL], browser=False, token="of-both", port=port)
    with contextlib.closing(page), again:
        page.wait("document.getElementById('messages').textContent.includes('No longer open: ball.npy.')")
        assert "other.npy" in page.evaluate("document.getElementById('objects').textContent")
        ends = page.evaluate("[...document.querySelectorAll('#histogram text.end')].map(each => +each.textContent)")
        np.testing.assert_allclose(ends, [np.load(other).min(), 2000], rtol=1e-3)
        assert page.evaluate("isospline.slices.zoom") == 1
        assert not page.problems


def test_files_of_the_same_name_are_shown_again_in_their_order(ball, tmp_path):
    """What the page asks for: of two, one may be left."""
    other = tmp_path / "other" / "ball.npy"
    other.parent.mkdir()
    np.save(other, 2 * np.load(ball))
    sources = [{"key": key, "name": "ball.npy"} for key in ("old1", "old2")]
    objects = [{"id": id, "source": key, "level": 10.0} for id, key in enumerate(("old1", "old2"))]
    for files, keys in (((ball, other), ["source1", "source2"]), ((ball,), ["source1"])):
        with isospline.view(*files, browser=False) as viewer:
            client = Client(viewer)
            client.receive("state")
            client.send(type="restore", sources=sources, state={"objects": objects}, input=1)
            while client.receive("state")[0]["input"] != 1:
                pass
            assert [each.source for each in viewer.state.objects] == keys
            client.close()


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"objects": [{"id": 0, "source": "a", "level": None}]}, "level: expected a number, as ball.npy is a volume"),
        ({"objects": [{"id": 0, "source": "b", "level": 1.0}]}, "level: expected null, as source2 is a mesh"),
        ({"objects": [{"id": 0, "source": "a", "level": 1.0, "color_by": "b"}]}, "color_by: expected the key of a vol"),
        ({"slices": {"shown": True, "volume": "b"}}, "slices: expected the key of a volume"),
        ({"camera": {"eye": [1, 2, 3], "target": [1, 2, 3], "up": [0, 0, 1]}}, "target: expected a point other than"),
    ],
)
def test_states_that_cannot_be_drawn_are_not_shown_again(ball, state, message):
    """They would be in the way of every window."""
    with isospline.view(ball, isospline.Mesh(9 * np.eye(3), [(0, 1, 2)]), browser=False) as viewer:
        before = viewer.state.objects
        client = Client(viewer)
        client.receive("frame")
        names = [{"key": "a", "name": "ball.npy"}, {"key": "b", "name": "source2"}]
        client.send(type="restore", sources=names, state=state)
        assert message in client.receive("error")[0]["text"]
        assert viewer.state.objects == before
        client.close()
        again = Client(viewer)
        assert again.receive("frame", "error")[0]["type"] == "frame"
        again.close()


@pytest.mark.slow
def test_a_page_of_a_viewer_with_another_token_says_so(context, large_ball):
    with isospline.view(large_ball, levels=[LEVEL], browser=False) as viewer:
        page = Page(context, viewer.url, SMALL, expected=("ERR_CONNECTION_REFUSED", "Unexpected response code: 403"))
        page.settle()
        port = port_of(viewer)
    with contextlib.closing(page), isospline.view(large_ball, levels=[3.0], browser=False, port=port):
        page.wait("document.getElementById('messages').textContent.includes('with another token')")
        assert page.evaluate("isospline.state.objects[0].level") == LEVEL
