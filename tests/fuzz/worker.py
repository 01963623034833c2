"""A process that runs the cases whose numbers it reads, and tells before and after each."""

import os
import resource
import sys
import traceback
import warnings

# Beyond the libraries' own address space; a case that wants more gets a MemoryError, or is a failure.
ADDRESS_SPACE = 6 << 30


def main(kind):
    """Run cases of a kind until there are no more numbers."""
    # What libraries print goes to the log of the worker.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    from .call_cases import CallCases
    from .file_cases import FileCases
    from .outcomes import Failed

    cases = {"files": FileCases, "calls": CallCases}[kind]()
    with open("/proc/self/statm") as file:
        used = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + ADDRESS_SPACE,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print("ready", file=answers)
    for line in sys.stdin:
        number = int(line)
        try:
            print("done", number, cases.run(number), file=answers)
        except BaseException as error:
            what = f"{type(error).__name__}: {error}" if not isinstance(error, Failed) else str(error)
            if not isinstance(error, Failed):
                traceback.print_exc()
            print("done", number, "FAILED", " ".join(f"{cases.describe(number)}: {what}".split())[:500], file=answers)


if __name__ == "__main__":
    main(sys.argv[1])
