"""Writes python/isospline/_core.pyi: what pybind11-stubgen finds in the compiled module, with stub_overlay.pyi.

mypy's stubgen was tried as well: it drops the mark of keyword-only parameters, so its output is not always Python.
"""

import argparse
import ast
import copy
import itertools
import subprocess
import sys
import tempfile
from pathlib import Path

import isospline._core
from isospline.base.values import value_types

REPOSITORY = Path(__file__).resolve().parent.parent
STUB = REPOSITORY / "python" / "isospline" / "_core.pyi"
OVERLAY = Path(__file__).with_name("stub_overlay.pyi")
VAGUE = {"Any", "str", "dict", "list", "tuple", "Iterator", "np.ndarray"}
PARAMETER_TYPES = {"Any": "ArrayLike", "np.ndarray": "NDArray[Any]", "dict": "dict[str, Any]"}
RESULT_TYPES = {"np.ndarray": "NDArray[np.float64]", "dict": "dict[str, Any]"}
LEFT_OUT = {"__reduce__", "__repr__"}
ELLIPSIS = [ast.Expr(ast.Constant(...))]
VALUES = {each.__name__ for each in value_types()}


def generated():
    """What pybind11-stubgen writes about the module alone, without the package, whose functions hide pybind11's."""
    module = Path(isospline._core.__file__)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / module.name).symlink_to(module)
        subprocess.run([sys.executable, "-m", "pybind11_stubgen", "_core", "-o", "."], cwd=folder, check=True)
        return (Path(folder) / "_core.pyi").read_text(encoding="utf-8")


def united(options):
    return ast.parse(" | ".join(dict.fromkeys(options))).body[0].value


def options_of(annotation):
    """The members of a union, as texts."""
    if isinstance(annotation, ast.BinOp):
        return [*options_of(annotation.left), *options_of(annotation.right)]
    return [ast.unparse(annotation)]


class Table:
    """The annotated names of a class, and which of them are used."""

    def __init__(self, part):
        self.name = part.name
        self.types = {node.target.id: node.annotation for node in part.body if isinstance(node, ast.AnnAssign)}
        self.unused = {*self.types}

    def get(self, name, default=None):
        self.unused.discard(name)
        return self.types.get(name, default)


def is_property(function):
    return bool({"property", f"{function.name}.setter"} & {ast.unparse(each) for each in function.decorator_list})


def parameters_of(function):
    """The parameters of a function and their defaults, None for those without."""
    arguments = function.args
    listed = [*arguments.posonlyargs, *arguments.args]
    missing = [None] * (len(listed) - len(arguments.defaults))
    return [*listed, *arguments.kwonlyargs], [*missing, *arguments.defaults, *arguments.kw_defaults]


def patched(compiled, given):
    """A compiled function with the parameters and the result of one in the overlay."""
    if compiled is None:
        return given
    changed = copy.deepcopy(compiled)
    own = {argument.arg: (argument, default) for argument, default in zip(*parameters_of(given))}
    parameters, defaults = parameters_of(changed)
    for place, parameter in enumerate(parameters):
        if parameter.arg in own:
            argument, defaults[place] = own[parameter.arg]
            parameter.annotation = argument.annotation
    if missing := own.keys() - {each.arg for each in parameters}:
        raise SystemExit(f"{OVERLAY.name}: {given.name} has no parameters {missing}")
    changed.args.vararg = given.args.vararg or changed.args.vararg
    count = len(parameters) - len(changed.args.kwonlyargs)
    changed.args.defaults = [each for each in defaults[:count] if each is not None]
    changed.args.kw_defaults = defaults[count:]
    changed.returns = given.returns
    changed.decorator_list = [*given.decorator_list, *compiled.decorator_list]
    return changed


class Types(ast.NodeTransformer):
    """Types in the words of the overlay: without modules, numbers as numbers, unions and tuples by their names."""

    def __init__(self, names):
        self.names = names

    def visit_Attribute(self, node):
        if ast.unparse(node) == "numpy.bool":
            return ast.parse("np.bool_").body[0].value
        if ast.unparse(node.value) == "numpy":
            return ast.Attribute(ast.Name("np"), node.attr)
        return ast.Name(node.attr)

    def visit_Subscript(self, node):
        self.generic_visit(node)
        size = ast.unparse(node)
        if size.startswith("Annotated["):  # of arrays of C++: Annotated[Sequence[int], 'FixedSize(2)']
            kind, note = node.slice.elts
            if ast.unparse(kind) == "ArrayLike":
                return united([f"NDArray[{ast.unparse(note)}]"])
            item = ast.unparse(kind.slice)
            if ast.unparse(kind.value) == "list":
                return united([f"list[{item}]"])
            count = int("".join(filter(str.isdigit, note.value)))
            return self.named([f"tuple[{', '.join([item] * count)}]"])
        return node

    def visit_BinOp(self, node):
        options = [ast.unparse(self.visit(ast.parse(each).body[0].value)) for each in options_of(node)]
        for number, protocol in (("float", "SupportsFloat"), ("int", "SupportsInt")):
            if {protocol, "SupportsIndex"} <= {*options}:
                options = [number if each == protocol else each for each in options if each != "SupportsIndex"]
        if "PathLike" in options:
            options = ["str", "PathLike[str]", *(each for each in options if each not in ("str", "PathLike", "bytes"))]
        return self.named(["NDArray[np.float64]" if each == "np.ndarray" else each for each in options])

    def named(self, options):
        for name, members in self.names.items():
            if {*members} <= {*options}:
                options = [name, *(each for each in options if each not in members)]
        return united(options)


class Writer:
    def __init__(self, overlay):
        self.parts = {node.name: node for node in overlay.body if isinstance(node, ast.ClassDef)}
        self.tables = [Table(self.parts.pop(name)) for name in ("_Words", "_Parameters", "_Results")]
        self.words, self.parameters, self.results = self.tables
        families = Table(self.parts.pop("_Families")).types
        self.families = {name: options_of(members) for name, members in families.items()}
        self.bases = dict.fromkeys((*VALUES, *self.families), "_Value")
        self.bases.update((member, family) for family, members in self.families.items() for member in members)
        self.types = Types({"_Size": ["tuple[int, int]"], **self.families})

    def _typed(self, annotation, name, tables, otherwise):
        """The type in a signature, or if it says little, that of the overlay."""
        annotation = self.types.visit(annotation)
        kind = ast.unparse(annotation)
        if kind not in VAGUE:
            return annotation
        given = [each.get(name) for each in tables if name in each.types]
        return given[0] if given else united([otherwise.get(kind, kind)])

    def function(self, node):
        """A compiled function with better types."""
        arguments = node.args
        if any(each.arg.startswith("arg") for each in arguments.args):  # without a name
            arguments.posonlyargs, arguments.args = arguments.args, []
        words = [self.words] if node.name == "__init__" or not node.name.startswith("_") else []
        for argument, default in zip(*parameters_of(node)):
            if argument.annotation is None:  # self
                continue
            tables = [self.parameters, *words]
            argument.annotation = self._typed(argument.annotation, argument.arg, tables, PARAMETER_TYPES)
            if isinstance(default, ast.Constant) and default.value is None:
                options = options_of(argument.annotation)
                if not {"_Progress", "_Background"} & {*options}:
                    argument.annotation = united([*(each for each in options if each != "None"), "None"])
        node.returns = self._typed(node.returns, node.name, [self.results, *words], RESULT_TYPES)
        node.body = ELLIPSIS
        return node

    def whole_class(self, node):
        """A compiled class with its part of the overlay."""
        part = self.parts.pop(node.name, ast.ClassDef(node.name, [], [], [], []))
        own = Table(part)
        self.tables.append(own)
        functions = {}
        for each in node.body:
            if isinstance(each, ast.FunctionDef) and each.name not in LEFT_OUT:
                function = self.function(each)
                function.returns = own.get(each.name, function.returns)
                functions.setdefault(each.name, []).append(function)
        given = [each for each in part.body if isinstance(each, ast.FunctionDef)]
        for name in {each.name for each in given}:
            compiled = functions.get(name, [None])[0]
            functions[name] = [patched(compiled, each) for each in given if each.name == name]

        bases = part.bases or node.bases
        if node.name in self.bases:
            bases = [*bases, ast.Name(self.bases[node.name])]
        body = sorted(itertools.chain(*functions.values()), key=lambda each: (is_property(each), each.name))
        return ast.ClassDef(node.name, bases, [], body or ELLIPSIS, [])


def stub():
    """The text of the stub."""
    overlay = OVERLAY.read_text(encoding="utf-8")
    tree = ast.parse(overlay)
    begin = next(node.lineno for node in tree.body if isinstance(node, ast.ImportFrom))
    end = next(node.lineno for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "_Families")
    imported = {each.name for node in tree.body if isinstance(node, ast.ImportFrom) for each in node.names}
    writer = Writer(tree)
    classes, functions, constants = [], [], []
    for node in ast.parse(generated()).body:
        if isinstance(node, ast.ClassDef):
            classes.append(writer.whole_class(node))
        elif isinstance(node, ast.FunctionDef):
            functions.append(writer.function(node))
        elif isinstance(node, ast.AnnAssign) and node.target.id != "__all__":
            constants.append(ast.AnnAssign(node.target, writer.results.get(node.target.id, node.annotation), None, 1))
    if unused := {f"{each.name}.{name}" for each in writer.tables for name in each.unused}:
        raise SystemExit(f"{OVERLAY.name}: nothing has the names {unused}")
    text = "\n".join(
        [
            '"""Types of the compiled module, written by `make stubs`; its docstrings have the rest."""\n',
            *overlay.splitlines()[begin - 1 : end - 1],
            *(f"class {family}({writer.bases[family]}): ..." for family in writer.families if family not in imported),
            ast.unparse(ast.fix_missing_locations(ast.Module([*constants, *classes, *functions], []))),
        ]
    )
    formatter = [sys.executable, "-m", "ruff", "format", "--stdin-filename", STUB, "-"]
    return subprocess.run(formatter, input=text, capture_output=True, encoding="utf-8", check=True).stdout


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("output", nargs="?", default=STUB, type=Path)
    parser.parse_args().output.write_text(stub(), encoding="utf-8")
