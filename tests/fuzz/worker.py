"""A process that reads numbers of cases, runs the cases, and reports before and after each."""

import os
import resource
import sys
import traceback
import warnings

# Limit beyond the libraries' own address space; a case that needs more gets a MemoryError, or fails.
ADDRESS_SPACE = 6 << 30


def main(kind):
    """Run cases of one kind until there are no more numbers."""
    # Output of libraries goes to the worker's log.
    answers = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8", errors="backslashreplace")
    os.dup2(2, 1)
    warnings.simplefilter("ignore")
    from isospline.io import isolated

    from .call_cases import CallCases
    from .file_cases import FileCases
    from .outcomes import Failed

    isolated.SECONDS = 5.0  # some damaged files have readers search without end
    cases = {"files": FileCases, "calls": CallCases}[kind]()
    with open("/proc/self/statm", encoding="utf-8") as file:
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
