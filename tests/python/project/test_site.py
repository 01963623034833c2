"""The documentation's site: it is built without warnings, all links work, and pages fit into windows."""

import html.parser
import os
import signal
import subprocess
import sys
import urllib.parse

import pytest

pytest.importorskip("sphinx")
pytest.importorskip("playwright")
from browser import chromium

pytestmark = pytest.mark.slow

#: Seconds that the build may take: several times what it takes on two cores.
LONGEST = 1000
PAGES = ["index", "tutorial", "gallery/index", "howto/meshes", "method", "benchmarks", "reference/api/isospline.Volume"]


@pytest.fixture(scope="module", params=["text", pytest.param("gallery", marks=pytest.mark.long)])
def site(repository, request):
    """The folder of the built site. The code that makes the gallery runs in other tests, too."""
    if "LD_PRELOAD" in os.environ:
        pytest.skip("the site is built without sanitizers")
    folder = repository / "build" / "docs"
    log = folder / "sphinx.log"
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-X", "faulthandler", "-m", "sphinx", "-W", "--keep-going", "-n", "-q"]
    command += ["-D", f"plot_gallery={int(request.param == 'gallery')}"]
    with log.open("w", encoding="utf-8") as output:
        process = subprocess.Popen(
            [*command, "-d", folder / "doctrees", repository / "docs", folder / "html"],
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGABRT)  # each of its Python processes says what it was doing
            code = process.wait(60)
    assert code == 0, log.read_text(encoding="utf-8")
    return folder / "html"


class Links(html.parser.HTMLParser):
    """The addresses in a page, and the places in it that can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.ids = [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.links += [found[name] for name in ("href", "src") if found.get(name)]
        self.ids |= {found[name] for name in ("id", "name") if found.get(name)}


def test_links_and_pictures_are_there(site):
    pages = {path: Links(path) for path in site.rglob("*.html") if "_static" not in path.parts}
    assert len(pages) > 80
    missing = []
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            if not target.exists() or (parts.fragment and target in pages and parts.fragment not in pages[target].ids):
                missing.append(f"{path.relative_to(site)}: {link}")
    assert not missing


def test_every_example_is_in_the_gallery(site, repository):
    shown = {path.stem for path in (site / "gallery").rglob("*.html")}
    assert {path.stem for path in (repository / "examples").glob("*.py")} <= shown


def test_every_public_name_is_in_the_reference(site):
    import isospline

    documented = {path.stem.removeprefix("isospline.") for path in (site / "reference" / "api").glob("*.html")}
    assert set(isospline.__all__) <= documented


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.mark.parametrize("page", PAGES)
def test_page_fits_into_the_window(site, browser, page):
    """No page is wider than a phone or a monitor, shows an error, or needs another site."""
    window = browser.new_page(viewport={"width": 390, "height": 900})
    problems, outside = [], []
    window.on("pageerror", lambda error: problems.append(str(error)))
    window.on("console", lambda line: line.type == "error" and problems.append(line.text))
    window.on("request", lambda request: request.url.startswith("http") and outside.append(request.url))
    window.goto((site / f"{page}.html").as_uri())
    for width in (390, 1440):
        window.set_viewport_size({"width": width, "height": 900})
        assert window.evaluate("innerWidth") == width
        assert window.evaluate("document.documentElement.scrollWidth") <= width
        assert window.locator("h1").first.is_visible()
    broken = "[...document.images].filter(each => each.complete && !each.naturalWidth).length"
    assert window.evaluate(broken) == 0
    assert not problems and not outside
    window.close()
