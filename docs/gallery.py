"""The gallery: the scripts of examples/ as Sphinx-Gallery wants them, and the pictures that they write."""

import ast
import re
import shutil
from pathlib import Path

from PIL import Image
from sphinx_gallery.scrapers import figure_rst

import isospline

REPOSITORY = Path(__file__).resolve().parents[1]

#: Title and text of each section, and the examples in it; "More" has all others.
SECTIONS = {
    "First steps": (
        "From a file or an array to a picture, a model, a level.",
        ["010", "015", "200-first-try", "040", "050", "080", "090"],
    ),
    "Looks": (
        "Light, colour, cuts, transparency.",
        ["020", "060", "070", "125", "130", "135", "150", "155", "165", "185", "195", "260", "265"],
    ),
    "Cameras and layers": (
        "Lenses, panoramas, photographs, turntables, and layers of images.",
        ["100", "120", "140", "190", "210-photograph", "225", "230"],
    ),
    "Rays and points": (
        "What rays hit, how thick a solid is, and what is nearest.",
        ["030", "110", "170", "175", "180", "220", "255", "270", "275", "276", "277"],
    ),
    "Meshes, measures, other libraries": (
        "Numbers with their errors, meshes to print, and work with other tools and processes.",
        ["160", "187", "205", "215", "235", "240", "245", "250", "278"],
    ),
    "More": ("", []),
}


def configuration():
    """The value of `sphinx_gallery_conf`; writes the scripts into a folder of the build."""
    source = REPOSITORY / "build" / "docs" / "examples"
    write_scripts(source)
    unrun = [path.name for path in source.rglob("*.py") if needs_volumes(path)]
    return {
        "examples_dirs": str(source),
        "gallery_dirs": "gallery",
        "filename_pattern": f"^(?!.*({'|'.join(unrun)})).*[.]py$",
        "within_subsection_order": "FileNameSortKey",
        "image_scrapers": (pictures,),
        "reset_modules": (),
        "backreferences_dir": "gallery/backreferences",
        "doc_module": ("isospline",),
        "reference_url": {"isospline": None},
        "default_thumb_file": str(draw_thumbnail(source.parent / "no-picture.png")),
        "thumbnail_size": (480, 360),
        "download_all_examples": False,
        "show_signature": False,
        "show_memory": False,
        "write_computation_times": False,
        "min_reported_time": 3600,
        "abort_on_example_error": True,
        "remove_config_comments": True,
        "copyfile_regex": r"^$",
    }


def draw_thumbnail(path):
    """The picture of examples that print and draw nothing."""
    field = isospline.volumes.gyroid()
    volume = field.volume(48)
    ink = isospline.Outline(2, color=0.45, surface_color=0.9)
    scene = isospline.Scene(isospline.Isosurface(volume, field.level))
    isospline.render(scene, size=(480, 360), light=ink, background=0.9, samples=4).save(path)
    return path


def write_scripts(folder):
    """Copies of the examples, with a heading above the docstring, in a folder for each section."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "GALLERY_HEADER.rst").write_text(
        "Gallery\n=======\n\nEach picture is written by the script behind it, from volumes made of formulas.\n",
        encoding="utf-8",
    )
    for path in sorted((REPOSITORY / "examples").glob("*.py")):
        title = section_of(path)
        section = folder / f"{list(SECTIONS).index(title)}-{re.sub(r'[^a-z]+', '-', title.lower())}"
        if not section.exists():
            section.mkdir()
            text = SECTIONS[title][0]
            (section / "GALLERY_HEADER.rst").write_text(f"{title}\n{'-' * len(title)}\n\n{text}\n", encoding="utf-8")
        (section / path.name).write_text(with_heading(path), encoding="utf-8")


def section_of(path):
    for title, (_, names) in SECTIONS.items():
        if path.name.startswith(tuple(names)):
            return title
    return "More"


def needs_volumes(path):
    """Whether a script reads a real volume, which the repository does not have: the README shows its picture."""
    return "ISOSPLINE_VOLUMES" in path.read_text(encoding="utf-8")


def with_heading(path):
    source = path.read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(source), clean=True)
    title = path.stem.split("-", 1)[1].replace("-", " ").capitalize().replace(" ct", " CT")
    code = source.split('"""', 2)[2]
    if needs_volumes(path):
        docstring += "\n\n.. image:: /images/hero.jpg"
        code += "\n# sphinx_gallery_thumbnail_path = 'images/hero.jpg'\n"
    return f'"""\n{title}\n{"=" * len(title)}\n\n{docstring}\n"""{code}'


def pictures(block, block_vars, gallery_conf):
    """Takes what a script has written to the folder out/: pictures and videos."""
    folder = Path(block_vars["src_file"]).parent / "out"
    images, videos = [], []
    for path in sorted(folder.glob("*")):
        if path.suffix in (".png", ".jpg"):
            images.append(next(block_vars["image_path_iterator"]))
            Image.open(path).save(images[-1])
        elif path.suffix == ".mp4":
            videos.append(Path(gallery_conf["src_dir"]) / "made" / path.name)
            videos[-1].parent.mkdir(exist_ok=True)
            shutil.copyfile(path, videos[-1])
        path.unlink()
    if not images:
        return ""
    return figure_rst(images, gallery_conf["src_dir"])
