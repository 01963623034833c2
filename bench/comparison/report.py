"""The results as a table, and as a plot."""

from .methods import BASELINE, METHODS

WIDTHS = {"build s": 9, "MB": 9, "Mray/s": 9, "(min - max)": 17, "ratio": 7, "lost": 6, "wrong": 7, "differ": 8}
COLUMNS = " " * 18 + "".join(f"{title:>{width}}" for title, width in WIDTHS.items())


def table(result):
    """The rows of one subject and view."""
    hop_length = result["mean_hop_length"]
    lines = [
        f"{result['subject']}, {result['view']} view: {' x '.join(map(str, result['size']))} samples, level "
        f"{result['level']:g}, {result['cells']} cells of the shell; {result['rays']} rays, {result['hit']:.0%} hit"
        + (f", mean hop {hop_length:.3f} voxels" if hop_length else ""),
        COLUMNS,
    ]
    for name, method in result["methods"].items():
        rate = method["mray_per_second"]
        spread = f"({rate['minimum']:.3g} - {rate['maximum']:.3g})"
        ratio = f"{method['ratio']:.2f}" if method["ratio"] else "-"
        lost, wrong = (method["oracle"][key] if method["oracle"] else "-" for key in ("lost", "wrong"))
        differ = "-" if method["differ"] is None else method["differ"]
        lines.append(
            f"{name:<18}{method['build_seconds']:>9.3f}{method['memory'] / 1e6:>9.1f}{rate['median']:>9.3g}"
            f"{spread:>17}{ratio:>7}{lost:>6}{wrong:>7}{differ:>8}"
        )
    return "\n".join(lines)


def legend(options):
    """What the columns of the table mean."""
    return "\n".join([
        *(f"{name:<18}{what}" for name, what in METHODS.items()),
        "build s: from the coefficients to the first ray (triangles: from the samples); MB: shell or mesh, and what "
        "finds it",
        f"ratio: rate over that of {BASELINE}; "
        f"lost, wrong: of {options['oracle_rays']} random rays, by a float64 oracle",
        "differ: of all rays, those whose hit is not the one of embree_exact",
    ])


def plot(results, path):
    """Bars of the rates, one panel a view."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    views = list(dict.fromkeys(result["view"] for result in results))
    names = [name for name in METHODS if any(name in result["methods"] for result in results)]
    subjects = list(dict.fromkeys(result["subject"] for result in results))
    figure, panels = pyplot.subplots(
        len(views), 1, figsize=(7 + 0.8 * len(subjects), 1 + 3 * len(views)), squeeze=False, layout="constrained"
    )
    width = 0.85 / len(names)
    for view, axes in zip(views, panels[:, 0]):
        for i, name in enumerate(names):
            bars = [(subjects.index(result["subject"]), result["methods"][name]["mray_per_second"])
                    for result in results if result["view"] == view and name in result["methods"]]
            medians = [rate["median"] for _, rate in bars]
            errors = [[rate["median"] - rate["minimum"] for _, rate in bars],
                      [rate["maximum"] - rate["median"] for _, rate in bars]]
            axes.bar([at + (i - len(names) / 2 + 0.5) * width for at, _ in bars], medians, width, yerr=errors,
                     label=METHODS[name])
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(ticker.NullFormatter())
        axes.set_ylabel("Mray/s")
        axes.set_title(f"{view} view")
        axes.set_xticks(range(len(subjects)), subjects)
        axes.grid(axis="y", alpha=0.4)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small")
    figure.savefig(path, dpi=150)
    pyplot.close(figure)
