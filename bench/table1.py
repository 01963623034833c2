"""Table 1 of the paper, for any volume: the cells of the shell after each level of pruning, for both border rules.

    python bench/table1.py FILE LEVEL [--degree 2] [--boundary mirror] [--shape NZ NY NX --dtype TYPE]

The paper leaves cells on the border of the volume unpruned (`prune_border=False`); by default they are pruned as well.
"""

import argparse

import isospline

ROWS = [
    "Initial",
    "Pruning after one level",
    "Pruning after two levels",
    "Pruning after three levels",
    "Pruning after four levels",
]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", help="any file that isospline.read_volume reads")
    parser.add_argument("level", type=float)
    parser.add_argument("--degree", type=int, default=2, choices=(1, 2, 3))
    parser.add_argument("--boundary", default="mirror", choices=("mirror", "periodic"))
    parser.add_argument("--shape", type=int, nargs=3, metavar=("NZ", "NY", "NX"), help="of a raw file")
    parser.add_argument("--dtype", help="of a raw file")
    return parser.parse_args()


def counts(volume, level, prune_border):
    return [
        isospline.research.isosurface(volume, level, prune_depth=depth, prune_border=prune_border).shell.count
        for depth in range(len(ROWS))
    ]


def percent(count, initial):
    return f"{100 * count / initial:.0f}%" if initial else "-"


def main():
    arguments = parse_arguments()
    raw = {"shape": tuple(arguments.shape), "dtype": arguments.dtype} if arguments.shape else {}
    volume = isospline.read_volume(arguments.file, **raw).to_volume(
        degree=arguments.degree, boundary=arguments.boundary
    )
    paper = counts(volume, arguments.level, prune_border=False)
    ours = counts(volume, arguments.level, prune_border=True)

    print(f"{volume}, level {arguments.level:g}\n")
    print("| card(b) | border unpruned, as in the paper | | border pruned | |")
    print("|---|---:|---:|---:|---:|")
    for row, left, right in zip(ROWS, paper, ours):
        print(f"| {row} | {left} | {percent(left, paper[0])} | {right} | {percent(right, ours[0])} |")


if __name__ == "__main__":
    main()
