"""The code base: dependencies have one direction, files are short, stubs and docs agree with the module."""

import ast
import importlib
import importlib.metadata
import inspect
import re
import statistics
import sys
from pathlib import Path

import isospline
from isospline.base.values import value_types

CASE = re.compile(r'TEST_CASE\(\s*"[^"]*",\s*"([^"]*)"')
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)

# The folders that each folder of core/isospline may include, besides itself.
MAY_INCLUDE = {
    "util": set(),
    "math": {"util"},
    "spline": {"util", "math"},
    "cell": {"util", "math", "spline"},
    "brick": {"util", "math", "spline", "cell"},
    "measure": {"util", "math", "spline", "cell", "brick"},
    "shell": {"util", "math", "spline", "cell", "brick", "measure"},
    "trace": {"util", "math", "spline", "cell", "brick", "shell"},
    "query": {"util", "math", "spline", "cell", "brick", "measure", "shell", "trace"},
    "label": {"util", "math", "brick"},
    "polygonize": {"util", "math", "spline", "cell", "brick", "shell", "trace", "query"},
    "hopper": {"util", "math", "spline", "cell", "brick", "shell", "trace"},
    "scene": {"util", "math", "spline", "cell", "brick", "measure", "shell", "trace", "query"},
    "shade": {"util", "math", "spline", "shell", "trace"},
    "render": {"util", "math", "spline", "shell", "trace", "scene", "shade"},
    "io": {"util", "math"},
    "store": {"util", "math", "spline"},
}
# Headers with data only: io may include them.
DATA_TYPES = {"isospline/render/image.h"}


def sources(folder, *suffixes):
    return sorted(path for path in folder.rglob("*") if path.suffix in suffixes)


def read(path):
    return path.read_text(encoding="utf-8")


def includes(path):
    return INCLUDE.findall(read(path))


def test_includes_point_one_way(repository):
    core = repository / "core" / "isospline"
    wrong = []
    for path in sources(core, ".h", ".cpp"):
        if path.parent == core:
            continue
        folder = path.relative_to(core).parts[0]
        for include in includes(path):
            parts = include.split("/")
            if parts[0] != "isospline" or (folder == "io" and include in DATA_TYPES):
                continue
            if parts[1] != folder and parts[1] not in MAY_INCLUDE[folder]:
                wrong.append(f"{path.relative_to(repository)} includes {include}")
    assert not wrong


def test_includes_have_no_cycle(repository):
    core = repository / "core"
    graph = {
        str(path.relative_to(core)): [include for include in includes(path) if include.startswith("isospline/")]
        for path in sources(core, ".h")
    }
    done = set()

    def visit(header, trail):
        assert header not in trail, " -> ".join([*trail, header])
        if header in done:
            return
        for include in graph.get(header, []):
            visit(include, [*trail, header])
        done.add(header)

    for header in graph:
        visit(header, [])


def test_only_the_scene_includes_embree(repository):
    for path in sources(repository / "core", ".h", ".cpp"):
        if "scene" not in path.parts:
            assert not [include for include in includes(path) if re.match(r"embree|rtcore", include)], path


def test_core_knows_neither_python_nor_numpy(repository):
    for path in sources(repository / "core", ".h", ".cpp"):
        assert not [include for include in includes(path) if re.match(r"pybind11|Python\.h|numpy", include)], path


def test_headers_are_guarded(repository):
    for folder in ("core", "bindings", "bench", "tests"):
        for path in sources(repository / folder, ".h"):
            assert re.search("#pragma once|HWY_TARGET_TOGGLE", read(path)), path


def test_files_are_short(repository):
    lengths = {
        path: len(read(path).splitlines())
        for folder in ("core", "bindings", "python")
        for path in sources(repository / folder, ".h", ".cpp", ".py")
    }
    too_long = {str(path.relative_to(repository)): count for path, count in lengths.items() if count > 400}
    assert not too_long
    assert statistics.median(lengths.values()) <= 150


def test_lines_are_short(repository):
    wrong = [
        f"{path.relative_to(repository)}:{number}"
        for folder in ("core", "bindings", "python", "tests", "examples", "bench")
        for path in sources(repository / folder, ".h", ".cpp", ".py", ".cmake")
        for number, line in enumerate(read(path).splitlines(), 1)
        if len(line) > 120 or line != line.rstrip()
    ]
    assert not wrong


def test_text_has_an_encoding(repository):
    """Text is UTF-8 in every locale. Ruff finds mistakes only where it knows the type of a path."""
    wrong = []
    paths = [
        path
        for folder in ("python", "tests", "examples", "bench", "docs", "tools")
        for path in sources(repository / folder, ".py")
    ]
    for path in (path for path in paths if re.search(r"(read|write)_text\(|\btext *=|universal_newlines", read(path))):
        for call in ast.walk(ast.parse(read(path))):
            if isinstance(call, ast.Call):
                name = call.func.attr if isinstance(call.func, ast.Attribute) else ""
                keywords = {keyword.arg for keyword in call.keywords}
                lacks = name in {"read_text", "write_text"} and "encoding" not in keywords
                if lacks or (name in {"run", "Popen"} and keywords & {"text", "universal_newlines"}):
                    wrong.append(f"{path.relative_to(repository)}:{call.lineno}")
    assert not wrong


def test_every_source_is_built(repository):
    listed = read(repository / "CMakeLists.txt")
    for path in sources(repository / "core", ".cpp"):
        assert str(path.relative_to(repository)) in listed, path
    listed = read(repository / "tests" / "CMakeLists.txt")
    for path in sources(repository / "tests" / "core", ".cpp"):
        assert str(path.relative_to(repository / "tests")) in listed, path
    listed = read(repository / "bindings" / "CMakeLists.txt")
    for path in sources(repository / "bindings", ".cpp"):
        assert path.name in listed, path
    listed = read(repository / "bench" / "CMakeLists.txt")
    for path in sources(repository / "bench" / "cpp", ".cpp"):
        assert f"cpp/{path.name}" in listed, path


def test_tests_mirror_the_folders_of_the_core(repository):
    folders = {path.parent.name for path in sources(repository / "core" / "isospline", ".h", ".cpp")} - {"isospline"}
    tested = {path.parent.name for path in sources(repository / "tests" / "core", ".cpp")} - {"core"}
    assert tested == folders


def test_cases_carry_the_name_of_their_folder(repository):
    """Then ctest runs each of them once and sums up their time by folder."""
    core = repository / "tests" / "core"
    cases = [(path, tags) for path in sources(core, ".cpp") for tags in CASE.findall(read(path))]
    assert len(cases) > 150
    assert not [(path, tags) for path, tags in cases if not tags.startswith(f"[{path.parent.name}]")]
    text = read(repository / "tests" / "CMakeLists.txt")
    listed = re.search(r"foreach\(\s*folder\s+([^)]*)\)", text).group(1)
    assert set(listed.split()) == {path.parent.name for path in sources(core, ".cpp")} - {"core"}


def test_no_target_needs_the_build_machine(repository):
    for path in [*sources(repository / "cmake", ".cmake"), *repository.glob("**/CMakeLists.txt")]:
        assert not re.search(r"-march|-mtune|-mcpu", read(path)), path


def test_version_is_the_same_everywhere(repository):
    version = re.search(r"project\(isospline VERSION ([0-9.]+)", read(repository / "CMakeLists.txt")).group(1)
    assert isospline.__version__ == version
    assert importlib.metadata.version("isospline") == version
    assert re.search(rf"^## \[?{re.escape(version)}", read(repository / "CHANGELOG.md"), re.MULTILINE)


def test_readme_is_short(repository):
    assert len(read(repository / "README.md").splitlines()) < 120


def test_docs_mention_every_public_name(repository):
    text = "\n".join(read(path) for path in sources(repository / "docs", ".md"))
    missing = [name for name in isospline.__all__ if not re.search(rf"\b{re.escape(name)}\b", text)]
    assert not missing


def test_public_names_have_docstrings():
    names = [name for name in isospline.__all__ if not inspect.ismodule(getattr(isospline, name))]
    assert not [name for name in names if not name.startswith("__") and not inspect.getdoc(getattr(isospline, name))]


def test_the_compiled_module_has_no_docstrings():
    """Signatures only: its public classes and functions are those of the package, which have docstrings."""
    documented = []
    for name, member in vars(importlib.import_module("isospline._core")).items():
        for inner, each in {"": member, **(vars(member) if inspect.isclass(member) else {})}.items():
            if type(each).__name__ in ("builtin_function_or_method", "instancemethod", "property", "pybind11_type"):
                text = each.__doc__ or ""
                documented += [(name, inner)] * (text != "" and not text.startswith(f"{inner or name}("))
    assert not documented


def test_modules_list_no_decorators_as_theirs():
    """Linters add what a module imports and does not use to its `__all__`."""
    for module in [each for name, each in sys.modules.items() if name.split(".")[0] == "isospline"]:
        listed = [getattr(module, name) for name in getattr(module, "__all__", ())]
        homes = {getattr(each, "__module__", None) for each in listed}
        assert not homes & {"isospline.base.handed", "isospline.base.mistakes", "isospline.base.signatures"}, module


def test_the_package_is_typed():
    package = Path(isospline.__file__).parent
    assert (package / "py.typed").exists()
    assert (package / "_core.pyi").exists()


def test_what_is_called_by_its_name_is_handed_over(repository):
    """By `handed` or `public`, or as a class of values; nothing else is handed over."""
    called = set()
    for path in sources(repository / "bindings", ".h", ".cpp"):
        called |= set(re.findall(r'(?:\bhanded|as_result)\((?:linear \? )?"(\w+)"', read(path)))
    given, public = set(), set()
    for path in sources(repository / "python", ".py"):
        called |= set(re.findall(r'\bknown\("(\w+)"\)', read(path)))
        for mark, names in (("handed", given), ("public", public)):
            names |= set(re.findall(rf"^@{mark}\n(?:@.*\n)*(?:def|class) (\w+)", read(path), re.MULTILINE))
    called -= {kind.__name__ for kind in value_types()} | public
    assert called >= {"sentence", "show_in_viewer", "Hits"} and called | {"encoded"} == given
