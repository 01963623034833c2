"""The pages of the documentation and the README as programs: their code runs, block by block.

Blocks of a page share names and a folder, which has the files that the pages speak of (`FILES`).

- ``python`` blocks are executed. A ``text`` block right after one is what it prints; ``...`` stands for anything.
- ``sh`` blocks are run by bash; for tests, those with commands of ours alone are run in this process. `make` only says
  what it would do, and `pip` only looks whether the package has the named extras. `isospline view` is ended once its
  page has been loaded.
- For tests, pictures have few pixels and few samples, and ``<!-- small: 96 = 48 -->`` replaces a number in the page.
- Rows of a table with code in two columns: on the right ours, on the left another library's, if it is installed.
- ``<!-- skip: next "reason" -->`` before a block leaves it out; ``<!-- invisible-code-block: python -->`` is not shown.
"""

import contextlib
import doctest
import importlib.util
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import unittest.mock
from pathlib import Path

import matplotlib
import matplotlib.figure
import numpy as np
from sybil import Document, Region
from sybil.evaluators.python import PythonEvaluator
from sybil.parsers.markdown import CodeBlockParser, SkipParser

import isospline.cli.main

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = [
    REPOSITORY / "README.md",
    REPOSITORY / "CONTRIBUTING.md",
    REPOSITORY / "bench" / "README.md",
    *sorted(path for path in (REPOSITORY / "docs").rglob("*.md") if "gallery" not in path.parts),
]
#: Where the build puts the files that the code of a page writes, a folder for each page.
MADE = REPOSITORY / "docs" / "made"

#: Seconds that a block of commands may take.
LONGEST = 600

ROW = re.compile(r"^\| `(?P<theirs>.+?)` \| `(?P<ours>.+)` \|$", re.MULTILINE)
IMPORT = re.compile(r"^`(?P<code>import (?P<library>\w+).*)`$", re.MULTILINE)

# Commands that a test cannot run as they are.
COMMANDS = Path(__file__).with_name("page_commands.py")
PRELUDE = f"""
set -euo pipefail
make() {{ command make --dry-run --directory "{REPOSITORY}" "$@" > /dev/null; }}
pip() {{ "{sys.executable}" "{COMMANDS}" "$@"; }}
isospline() {{
    case "$1 $* " in
    "view "*) "{sys.executable}" "{COMMANDS}" "$@" ;;
    "render "*" --size "*) command isospline "$@" ;;
    "render "*) command isospline "$@" $PICTURES ;;
    *) command isospline "$@" ;;
    esac
}}
"""


class Printing:
    """Executes Python, or a command, and keeps what it prints."""

    def __init__(self, evaluate):
        self.evaluate = evaluate

    def __call__(self, example):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            self.evaluate(example)
        example.namespace["printed"] = printed.getvalue()


def plain_commands(text):
    """The words of each line of a block that has commands of ours alone, and nothing else for the shell; or None."""
    lines = [shlex.split(line, comments=True) for line in text.replace("\\\n", " ").splitlines()]
    lines = [words for words in lines if words]
    is_plain = all(words[0] == "isospline" and words[1] != "view" for words in lines)
    return None if not is_plain or re.search(r"[|&;<>$*?`\n]", "".join(map("".join, lines))) else lines


def run_command(words):
    """Run a command of ours in this process, which has imported what it needs."""
    more = os.environ["PICTURES"].split() if words[1] == "render" and "--size" not in words else []
    told = io.StringIO()
    with contextlib.redirect_stderr(told), unittest.mock.patch.dict(os.environ, {"COLUMNS": "100"}):
        status = isospline.cli.main.main([*words[1:], *more])
    assert status == 0, f"{shlex.join(words)}:\n{told.getvalue()}"


def run_shell(example):
    if os.environ.get("PICTURES") and (commands := plain_commands(example.parsed)):  # for tests
        for words in commands:
            run_command(words)
        return
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-c", PRELUDE + example.parsed],
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=LONGEST,
        env={"PICTURES": "", **os.environ, "PATH": path, "COLUMNS": "100", "PYTHONUTF8": "1"},
    )
    assert done.returncode == 0, f"{example.path}:{example.line}:\n{example.parsed}\n{done.stdout}{done.stderr}"
    print(done.stdout)


def compare_text(example):
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    printed = example.namespace.get("printed")
    if printed is None or doctest.OutputChecker().check_output(example.parsed, printed, flags):
        return
    raise AssertionError(f"{example.path}:{example.line}: expected\n{example.parsed}\nand got\n{printed}")


def tables(document):
    """The imports and rows of tables that have code in two columns, in pages that import another library for them."""
    imports = list(IMPORT.finditer(document.text))
    for match in imports:
        yield Region(match.start(), match.end(), match, import_library)
    for match in ROW.finditer(document.text) if imports else ():
        yield Region(match.start(), match.end(), match, run_row)


def import_library(example):
    """Begins a section: `theirs` holds the names of the other library's lines, or is None where they cannot run."""
    match = example.parsed
    example.namespace["theirs"] = dict(example.namespace) if can_run(match["library"]) else None
    if example.namespace["theirs"] is not None:
        exec(match["code"], example.namespace["theirs"])


def run_row(example):
    if example.namespace["theirs"] is not None:
        exec(example.parsed["theirs"], example.namespace["theirs"])
    exec(example.parsed["ours"], example.namespace)


def can_run(library):
    """Whether a library is installed, and draws if it is PyVista, which ends the process without OpenGL."""
    if importlib.util.find_spec(library) is None:
        return False
    if library != "pyvista":
        return True
    code = "import pyvista; plotter = pyvista.Plotter(off_screen=True); plotter.add_mesh(pyvista.Sphere()); "
    done = subprocess.run([sys.executable, "-c", code + "plotter.screenshot()"], capture_output=True, check=False)
    return done.returncode == 0


PARSERS = [
    CodeBlockParser("python", Printing(PythonEvaluator())),
    CodeBlockParser("sh", Printing(run_shell)),
    CodeBlockParser("text", compare_text),
    SkipParser(),
    tables,
]


def parse(page, small):
    text = page.read_text(encoding="utf-8")
    document = Document(made_small(text) if small else text, str(page))
    for parser in PARSERS:
        for region in parser(document):
            document.add(region)
    return document


def made_small(text):
    """A page whose pictures have few pixels, and few samples in each, and with the numbers that it gives for tests."""
    for number, small in re.findall(r"<!-- small: (.+?) = (.+?) -->", text):
        text = re.sub(rf"(?<![\d.]){re.escape(number)}(?![\d.])", small, text)
    text = re.sub(r"\bsize=\(\d{3,}, \d{3,}\)", "size=(64, 48)", text)
    text = re.sub(r"--size \d+x\d+", "--size 64x48", text)
    return re.sub(r"\b(samples=|--samples )\d\d?\b", r"\g<1>2", text)


def run(page, folder, small=False, files=None):
    """Execute the code of a page in a folder, which gets the files that it speaks of; returns the number of blocks.

    The files are made, or copied from a folder in which `make_files` has made them.
    """
    if files is None:
        make_files(folder)
    else:
        shutil.copytree(files, folder, dirs_exist_ok=True)
    here = os.getcwd()
    os.chdir(folder)
    same_names = matplotlib.rc_context({"svg.hashsalt": page.stem})  # in SVG files, otherwise random
    options = unittest.mock.patch.dict(os.environ, {"PICTURES": "--size 64x48"} if small else {})
    shown = unittest.mock.patch("PIL.ImageShow.show")  # opens a window
    try:
        with same_names, options, shown:
            count = 0
            for example in parse(page, small).examples():
                with contextlib.suppress(unittest.SkipTest):
                    example.evaluate()
                    count += 1
            return count
    finally:
        os.chdir(here)


def make_pictures():
    """Execute the pages that show what their own code writes."""
    shutil.rmtree(MADE, ignore_errors=True)
    for page in PAGES:
        if "made/" in page.read_text(encoding="utf-8"):
            run(page, MADE / page.stem)


def draw_stand_ins():
    """Draw grey pictures in place of missing ones that the code of pages writes, for a quick build."""
    for page in PAGES:
        for name in re.findall(r"\bmade/[\w/-]+[.](?:png|svg)", page.read_text(encoding="utf-8")):
            path = MADE.parent / name
            if path.exists():
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            figure = matplotlib.figure.Figure(figsize=(3.2, 2.4), facecolor="lightgrey")
            figure.savefig(path)


def make_files(folder, samples=48):
    """Write the files that pages speak of: a head of ellipsoids, in millimetres, and what goes with it."""
    import pyvista
    import SimpleITK
    import trimesh

    folder.mkdir(parents=True, exist_ok=True)
    spacing = 240 / samples
    z, y, x = (np.indices((samples,) * 3) - (samples - 1) / 2) * spacing

    def depth(center, radii):
        """How deep points are in an ellipsoid, roughly in millimetres."""
        scaled = [(a - b) / radius for a, b, radius in zip((x, y, z), center, radii)]
        return (1 - np.sqrt(sum(each**2 for each in scaled))) * min(radii)

    def union(*depths):
        """The union of solids, rounded where they meet."""
        return 9 * np.logaddexp.reduce([each / 9 for each in depths])

    def filled(depths):
        """1 inside and 0 outside, with a border as blurred as that of a scanner."""
        return 1 / (1 + np.exp(-depths / (0.7 * spacing)))

    skull = union(depth((0, 10, 20), (76, 95, 85)), depth((0, -24, -38), (50, 64, 56)))
    nose, neck = depth((0, -88, -8), (12, 20, 22)), depth((0, 26, -95), (48, 50, 75))
    sockets = np.maximum(depth((-32, -74, 6), (19, 26, 17)), depth((32, -74, 6), (19, 26, 17)))
    soft = filled(union(skull, nose, neck))
    hard = filled(np.minimum(np.minimum(skull - 12, 26 - skull), -sockets))

    def write(name, values):
        image = SimpleITK.GetImageFromArray(values)
        image.SetSpacing((spacing,) * 3)
        image.SetOrigin((-spacing * (samples - 1) / 2,) * 3)
        SimpleITK.WriteImage(image, str(folder / name))

    write("head.nii.gz", (1000 * soft + 600 * hard).astype(np.int16))
    write("hip.nii.gz", (1000 * soft + 600 * hard).astype(np.int16))
    skin, bone, brain = union(skull, nose, neck) > 0, np.minimum(skull - 12, 26 - skull) > 0, skull > 26
    segments = np.select([brain & (x > 0), brain, bone & (sockets < 0), skin], [3, 2, 4, 1])
    write("seg.nii.gz", segments.astype(np.uint8))
    write("dose.nrrd", np.maximum(0, 60 - np.hypot(x, y) / 2).astype(np.float32))
    around = isospline.PanoramicCamera((0, 0, 0), (0, 1, 0))
    isospline.render(isospline.Scene(), around, size=(32, 16), background=(0.6, 0.7, 0.9)).write(folder / "sky.exr")
    trimesh.creation.cylinder(15, 120).export(folder / "implant.stl")
    trimesh.creation.icosphere(2, 0.8).export(folder / "part.stl")
    np.savetxt(folder / "part.txt", np.diag((40, 40, 40, 1)))

    field = isospline.volumes.sphere(0.7)
    grid = pyvista.ImageData(dimensions=(20,) * 3, **field.grid(20))
    grid["values"] = field.values(20).ravel()
    grid.save(folder / "volume.vti")
    tooth = isospline.volumes.heart().values((161, 94, 103))
    tooth = (1000 + 600 * tooth).clip(0, 4000).astype(np.uint16)
    tooth.tofile(folder / "tooth.raw")
    tooth.tofile(folder / "tooth_103x94x161_uint16.raw")


def photograph(address, path, size):
    """Take a picture of the viewer's page in a browser, once it has drawn all that there is."""
    sys.path.insert(0, str(REPOSITORY / "tests" / "python"))
    from browser import Page, chromium

    with chromium() as browser:
        page = Page(browser, address, size)
        page.wait("!!window.isospline")
        for section in ("surfaces", "cut"):
            page.open(section)
        page.settle()
        page.page.screenshot(path=path)
