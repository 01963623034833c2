"""Write a real volume for the C++ benchmarks (bench/README.md, "In C++"): write_subject.py NAME FOLDER"""

import sys
from pathlib import Path

from suite import native, subjects
from suite.settings import Settings


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    name, folder = sys.argv[1], Path(sys.argv[2])
    subject = next(subjects.real(name), None)
    if subject is None:
        sys.exit(f"NAME: expected a part of the name of a file in ISOSPLINE_VOLUMES, got {name}")
    folder.mkdir(parents=True, exist_ok=True)
    native.write(subject, folder, Settings())


if __name__ == "__main__":
    main()
