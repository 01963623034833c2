"""The README and the pages of the documentation: their code runs, and the targets of their links exist."""

import re
import shlex
import sys
from pathlib import Path

import pytest

pytest.importorskip("sybil")
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "docs"))
import pages

from isospline.cli.parser import join_negative, make_parser

pytestmark = pytest.mark.slow

# Languages of blocks that are run, or that contain no code.
RUN = {"python", "sh", "text"}
SHELL = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
#: A command of ours, without what follows a pipe, a redirection or an ampersand.
COMMAND = re.compile(r"^isospline [^|>&\n]*", re.MULTILINE)
FENCE = re.compile(r"^```(\S*)", re.MULTILINE)
LINK = re.compile(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)")


def name_of(page):
    return str(page.relative_to(pages.REPOSITORY))


def runs_long(page):
    """Whether a page has many commands: make ci-long runs them, and make test looks whether they are known."""
    return page.name == "command-line.md"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with the files that pages speak of, small ones."""
    pytest.importorskip("pyvista")
    pytest.importorskip("SimpleITK")
    folder = tmp_path_factory.mktemp("files")
    pages.make_files(folder, samples=44)
    return folder


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=pytest.mark.long) if runs_long(page) else page for page in pages.PAGES],
    ids=name_of,
)
def test_code_of_page_runs(page, files, tmp_path):
    """The code runs with small pictures; the build of the site renders the pictures of pages in full size."""
    blocks = [each for each in FENCE.findall(page.read_text(encoding="utf-8"))[::2] if each in RUN]
    assert pages.run(page, tmp_path, small=True, files=files) >= len(blocks)


def test_commands_are_known():
    """Each command of a page has options that exist, with values of the right form."""
    parse = make_parser(*["run"] * 9).parse_args
    count = 0
    for page in pages.PAGES:
        for command in COMMAND.findall("".join(SHELL.findall(page.read_text(encoding="utf-8")))):
            words = shlex.split(command, comments=True)
            assert parse(join_negative(words[1:])), f"{page}: {command}"
            count += 1
    assert count > 50


@pytest.mark.parametrize("page", pages.PAGES, ids=name_of)
def test_no_block_escapes(page):
    """Every block with code is in a language that is run, and every skipped block has a reason."""
    text = page.read_text(encoding="utf-8")
    opened = FENCE.findall(text)[::2]
    assert not [each for each in opened if each not in RUN and not re.match(r"\{\w+\}", each)]
    assert not re.findall(r"<!-- skip: next -->|skip: start", text)


def anchors(page):
    """The anchors that GitHub and MyST give to headings."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", pages.PAGES, ids=name_of)
def test_links_within_the_repository_lead_somewhere(page):
    for path, anchor in LINK.findall(page.read_text(encoding="utf-8")):
        target = (page.parent / path).resolve() if path else page
        made_by_the_build = {"gallery", "made"} & set(target.parts)
        assert target.exists() or made_by_the_build, f"{page}: {path}"
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), f"{page}: {path}#{anchor}"


def test_text_that_differs_is_an_error(files, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nprint(1 + 1)\n```\n\n```text\n3\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="expected\n3"):
        pages.run(page, tmp_path, files=files)


@pytest.mark.parametrize("small", [False, True])
def test_command_that_fails_is_an_error(files, tmp_path, small):
    page = tmp_path / "page.md"
    page.write_text("```sh\nisospline info nothing.nii.gz\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError, match="nothing.nii.gz"):
        pages.run(page, tmp_path, small=small, files=files)


@pytest.mark.parametrize("command", ["make no-such-target", "pip install isospline[no-such-extra]"])
def test_commands_that_are_not_run_are_checked(command, files, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"```sh\n{command}\n```\n", encoding="utf-8")
    with pytest.raises(AssertionError):
        pages.run(page, tmp_path, files=files)
