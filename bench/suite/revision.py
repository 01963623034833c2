"""Another revision of the package, built beside the working tree, and the processes that measure it."""

import json
import os
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
WORKER = REPOSITORY / "bench" / "against_worker.py"


def package_of(revision):
    """The folder to import a revision's package from. A revision is a tree that has been built, given by its folder,
    or a commit, which is built in build/against."""
    folder = Path(revision)
    if folder.is_dir():
        built = folder.resolve()
    else:
        built = build(revision)
    package = built / "python"
    if not any((package / "isospline").glob("_core*")):
        raise SystemExit(
            f"REV: expected a commit or the folder of a built tree, got {revision}: no {package}/isospline/_core"
        )
    return package


def build(revision):
    """Builds the compiled module of a commit in a worktree of its own; quick if it was built before."""
    commit = git("rev-parse", "--verify", "--short=12", f"{revision}^{{commit}}")
    tree = REPOSITORY / "build" / "against" / commit
    if not tree.exists():
        git("worktree", "prune")
        git("worktree", "add", "--quiet", "--detach", tree, commit)
    import pybind11

    print(f"== Building {revision} in {tree.relative_to(REPOSITORY)}", flush=True)
    options = {
        "ISOSPLINE_BUILD_PYTHON": "ON",
        "ISOSPLINE_BUILD_TESTS": "OFF",
        "ISOSPLINE_BUILD_BENCH": "OFF",
        "ISOSPLINE_WARNINGS_AS_ERRORS": "OFF",  # of compilers younger than the revision
        "pybind11_DIR": pybind11.get_cmake_dir(),
        "Python_EXECUTABLE": sys.executable,
    }
    build_folder = tree / "build" / "release"
    configure = ["cmake", "--preset", "release", *(f"-D{name}={value}" for name, value in options.items())]
    for command in (configure, ["cmake", "--build", build_folder, "--target", "_core"]):
        done = subprocess.run(command, cwd=tree, capture_output=True, encoding="utf-8", check=False)
        if done.returncode != 0:
            raise SystemExit(f"REV: {revision} cannot be built:\n{done.stdout[-4000:]}{done.stderr[-2000:]}")
    (module,) = build_folder.glob("bindings/_core*.so")
    link = tree / "python" / "isospline" / module.name
    link.unlink(missing_ok=True)
    link.symlink_to(module)
    return tree


def git(*arguments):
    command = ["git", "-C", REPOSITORY, *arguments]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if done.returncode != 0:
        raise SystemExit(f"REV: expected a commit or the folder of a built tree: {done.stderr.strip()}")
    return done.stdout.strip()


class Process:
    """A process of against_worker.py; its methods are those of the worker."""

    def __init__(self, package=None, settled=False):
        self.settled = settled  # whether its scenes are settled before they are traced
        environment = dict(os.environ)
        if package:
            paths = [str(package), *filter(None, [environment.get("PYTHONPATH")])]
            environment["PYTHONPATH"] = os.pathsep.join(paths)
        self.process = subprocess.Popen(
            [sys.executable, WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            encoding="utf-8",
            env=environment,
        )
        path = Path(self.module()["path"])
        if package and package not in path.parents:
            raise SystemExit(f"REV: expected the package in {package}, got that of {path}")

    def __getattr__(self, name):
        def call(**arguments):
            self.process.stdin.write(json.dumps([name, arguments]) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
            if not line:
                raise RuntimeError(f"{name}: the process ended with status {self.process.wait()}")
            reply = json.loads(line)
            if "error" in reply:
                raise RuntimeError(f"{name} failed:\n{reply['error']}")
            return reply["result"]

        return call

    def close(self):
        self.process.stdin.close()
        self.process.wait()
