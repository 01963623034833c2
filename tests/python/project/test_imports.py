"""Imports between the modules of the package: without circles, and no more than is needed."""

import ast
import subprocess
import sys

import pytest

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


def statements(body):
    """The imports that run when a module is loaded: not those in functions, nor those for type checkers."""
    for each in body:
        if isinstance(each, (ast.Import, ast.ImportFrom)):
            yield each
        elif isinstance(each, ast.If) and "TYPE_CHECKING" not in ast.unparse(each.test):
            yield from statements([*each.body, *each.orelse])
        elif isinstance(each, ast.Try):
            yield from statements(each.body)


def imported(name, path):
    """The full names that a module imports when it is loaded."""
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for each in statements(ast.parse(path.read_text(encoding="utf-8")).body):
        if isinstance(each, ast.Import):
            yield from (alias.name for alias in each.names)
            continue
        base = (
            [*package[: len(package) - each.level + 1], *filter(None, [each.module])] if each.level else [each.module]
        )
        yield from (".".join([*base, alias.name]) for alias in each.names)


def edges(modules):
    """The modules that each module loads; a name that is no module counts for the module that it is taken from."""
    graph = {}
    for name, path in modules.items():
        targets = set()
        for each in imported(name, path):
            parent = each.rpartition(".")[0]
            if each in modules:
                targets.add(each)
            elif parent in modules and not each.endswith("._core"):
                targets.add(parent)
        graph[name] = targets - {name}
    return graph


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


def test_only_the_command_line_imports_the_command_line(modules):
    """Modules that parse options are loaded by the command line alone."""
    graph = edges(modules)
    of_options = {name for name, path in modules.items() if "argparse" in set(imported(name, path))}
    of_options |= {name for name in modules if name.startswith("isospline.cli")} | {"isospline.looks"}
    for name, targets in graph.items():
        if name not in of_options and name != "isospline.__main__":
            assert not targets & of_options, name


def test_nothing_of_posix_alone_is_imported_at_the_top(modules):
    for name, path in modules.items():
        if not name.endswith("isolated_server"):  # a process of its own
            assert not {each.partition(".")[0] for each in imported(name, path)} & POSIX_ONLY, name


def test_import_loads_neither_the_command_line_nor_the_viewer():
    code = (
        "import sys, isospline; "
        "ours = ('isospline.cli', 'isospline.viewer', 'isospline.looks'); "
        "others = ('argparse', 'asyncio', 'websockets', 'zarr', 'dask', 'vtkmodules', 'pyvista', 'trimesh'); "
        "print([name for name in sys.modules if name.startswith(ours) or name in others]); "
        "print(isospline.view.__module__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert done.stdout.split("\n")[:2] == ["[]", "isospline.viewer.show"], done.stdout
