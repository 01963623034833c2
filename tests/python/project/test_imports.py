"""Imports between the modules of the package: without circles, downwards, and no more than is needed."""

import ast
import functools
import subprocess
import sys

import pytest

#: The modules and folders of the package from below; that of "" is the package itself. They are drawn in
#: docs/architecture.md.
LAYERS = (
    {"base"},
    {"cameras", "clips", "colors", "io", "lights"},
    {"certificates", "interop", "looks"},
    {"scene"},
    {"farthest", "levels", "volumes"},
    {"distances"},
    {"color_rules", "derivatives", "labels", "store", "suggest"},
    {"picture", "research", "torch"},
    {"distributed", "viewer"},
    {"measures", "showing"},
    {""},
    {"cli"},
)
POSIX_ONLY = {"fcntl", "grp", "pwd", "resource", "termios"}


@pytest.fixture(scope="module")
def modules(repository):
    """The files of the package by the names of their modules."""
    root = repository / "python" / "isospline"
    found = {}
    for path in root.rglob("*.py"):
        parts = path.relative_to(root.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def statements(tree, in_functions):
    """The imports that run when a module is loaded, and those in functions if wanted; not those for type checkers."""
    for each in ast.iter_child_nodes(tree):
        if isinstance(each, (ast.Import, ast.ImportFrom)):
            yield each
        elif isinstance(each, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            if in_functions:
                yield from statements(each, in_functions)
        elif not (isinstance(each, ast.If) and "TYPE_CHECKING" in ast.unparse(each.test)):
            yield from statements(each, in_functions)


@functools.cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(name, path, in_functions=False):
    """The full names that a module imports."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for each in statements(parsed(path), in_functions):
        if isinstance(each, ast.Import):
            yield from (alias.name for alias in each.names)
            continue
        base = (
            [*package[: len(package) - each.level + 1], *filter(None, [each.module])] if each.level else [each.module]
        )
        yield from (".".join([*base, alias.name]) for alias in each.names)


def edges(modules, in_functions=False):
    """The modules that each module imports; a name that is no module counts for the module that it is taken from."""
    graph = {}
    for name, path in modules.items():
        targets = set()
        for each in imported(name, path, in_functions):
            parent = each.rpartition(".")[0]
            if each in modules:
                targets.add(each)
            elif parent in modules and each != "isospline._core":
                targets.add(parent)
        graph[name] = targets - {name}
    return graph


def part_of(name):
    """The folder or file of the package that a module is in; `python -m isospline` is the command line."""
    part = name.split(".")[1] if "." in name else ""
    return "cli" if part == "__main__" else part


def layer(part):
    """The number of a part's layer, from 1 for the lowest one."""
    return next(number for number, names in enumerate(LAYERS, 1) if part in names)


def test_modules_import_without_circles(modules):
    graph, done = edges(modules), set()

    def visit(name, trail):
        assert name not in trail, " -> ".join([*trail, name])
        if name not in done:
            for each in graph[name]:
                visit(each, [*trail, name])
            done.add(name)

    for name in graph:
        visit(name, [])


def test_imports_point_downwards(modules):
    """Also those in functions: what a layer needs of a higher one is handed to it."""
    for name, targets in edges(modules, in_functions=True).items():
        for target in targets:
            from_part, to_part = part_of(name), part_of(target)
            assert from_part == to_part or layer(to_part) < layer(from_part), f"{name} imports {target}"


def test_nothing_of_posix_alone_is_imported_at_the_top(modules):
    for name, path in modules.items():
        if not name.endswith("isolated_server"):  # a process of its own
            assert not {each.partition(".")[0] for each in imported(name, path)} & POSIX_ONLY, name


def test_import_loads_neither_the_command_line_nor_the_viewer():
    code = (
        "import sys, isospline; "
        "ours = ('isospline.cli', 'isospline.viewer'); "
        "others = ('argparse', 'asyncio', 'websockets', 'zarr', 'dask', 'vtkmodules', 'pyvista', 'trimesh'); "
        "tops = ['.'.join(name.split('.')[:2]) for name in sys.modules]; "
        "print([name for name in (*tops, *sys.modules) if name in (*ours, *others)]); "
        "print(isospline.view.__module__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.split("\n")[:2] == ["[]", "isospline.viewer.show"], done.stdout
