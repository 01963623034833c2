"""Plots of the results: rates, growth, time to the first picture, wrong pixels."""

from rows import growth, primary

TITLES = {
    "rates": "Rate of primary rays",
    "wrong": "Lost and wrong pixels",
    "growth": "Cost of a ray against the size of the volume",
    "frame": "Time from a level to its picture",
}
OF_ROW = {"primary": ("rates", "wrong"), "growth": ("growth",), "frame": ("frame",)}


def write(summary, folder):
    """Draws the plots that have results and removes the others. Returns the files by the names of their plots."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    draw = {"rates": draw_rates, "wrong": draw_wrong, "growth": draw_growth, "frame": draw_frame}
    paths = {}
    for row, name in ((row, name) for row, names in OF_ROW.items() for name in names):
        path = folder / f"bench-{name}.png"
        results = summary.get(row, {}).get("results")
        figure = draw[name](results, pyplot) if results else None
        if figure is None:
            path.unlink(missing_ok=True)
            continue
        figure.savefig(path, dpi=110)
        pyplot.close(figure)
        paths[name] = path
    return paths


def bars_of_methods(results, pyplot, names, value, unit):
    """One panel for each view, one group for each volume, one bar for each method."""
    views = list(dict.fromkeys(result["view"] for result in results))
    subjects = list(dict.fromkeys(result["subject"] for result in results))
    figure, panels = pyplot.subplots(
        len(views), 1, figsize=(6 + 0.8 * len(subjects), 1.4 + 2.6 * len(views)), squeeze=False, layout="constrained"
    )
    width = 0.85 / len(names)
    for view, axes in zip(views, panels[:, 0]):
        for i, name in enumerate(names):
            bars = {subjects.index(r["subject"]): value(r, name) for r in results if r["view"] == view}
            axes.bar(
                [at + (i - (len(names) - 1) / 2) * width for at in bars],
                list(bars.values()),
                width,
                label=primary.METHODS[name],
                color=f"C{list(primary.METHODS).index(name)}",
            )
        axes.set(ylabel=unit, title=f"{view} view")
        axes.set_xticks(range(len(subjects)), subjects)
        axes.grid(axis="y", alpha=0.4)
        axes.set_axisbelow(True)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize="small")
    return figure, panels[:, 0]


def draw_rates(results, pyplot):
    figure, panels = bars_of_methods(results, pyplot, list(primary.METHODS), primary.rate, "Mray/s")
    for axes in panels:
        axes.set_yscale("log")
        axes.set_ylim(bottom=0.1)
        plain_numbers(axes.yaxis)
    return figure


def draw_wrong(results, pyplot):
    """Wrong pixels of the methods that trace the spline's surface; the mesh is another surface. Methods and views
    without wrong pixels are left out."""

    def per_million(result, name):
        oracle = result["methods"][name]["oracle"]
        return 1e6 * (oracle["lost"] + oracle["wrong"]) / result["rays"]

    names = [
        name
        for name in primary.METHODS
        if not name.startswith("triangle") and any(per_million(result, name) for result in results)
    ]
    views = {result["view"] for result in results if any(per_million(result, name) for name in names)}
    if not names:
        return None
    figure, panels = bars_of_methods(
        [result for result in results if result["view"] in views],
        pyplot,
        names,
        per_million,
        "lost or wrong of a million pixels",
    )
    for axes in panels:
        axes.set_ylim(bottom=0, top=max(axes.get_ylim()[1], 1))
    return figure


def draw_growth(results, pyplot):
    figure, axes = pyplot.subplots(figsize=(7, 4.8), layout="constrained")
    for name, what in growth.WAYS.items():
        axes.plot([r["size"] for r in results], [r["ns"][name]["median"] for r in results], "o-", label=what)
    axes.set(xscale="log", yscale="log", xlabel="samples along each axis", ylabel="ns a ray")
    axes.set_xticks([r["size"] for r in results], [f"{r['size']}³" for r in results], minor=False)
    axes.minorticks_off()
    plain_numbers(axes.yaxis)
    axes.grid(alpha=0.4)
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
    return figure


def draw_frame(results, pyplot):
    """One panel for each volume, one bar for each method, with its stages side by side. VTK's volume mappers are left
    out: their bars would be many times as long."""
    figure, panels = pyplot.subplots(
        len(results), 1, figsize=(7, 0.6 + 0.9 * len(results)), squeeze=False, layout="constrained"
    )
    colors = {"level": "C0", "extract": "C3", "render": "C2"}
    shown = ("isospline", "VTK, mesh")
    for result, axes in zip(results, panels[:, 0]):
        for at, name in enumerate(shown):
            left = 0.0
            for stage, seconds in result["ways"][name]["stages"].items():
                axes.barh(at, 1e3 * seconds, left=1e3 * left, color=colors[stage])
                left += seconds
        axes.set_yticks(range(len(shown)), shown)
        axes.invert_yaxis()
        axes.set_title(result["subject"], fontsize="medium")
        axes.grid(axis="x", alpha=0.4)
        axes.set_axisbelow(True)
    panels[-1, 0].set_xlabel("ms")
    figure.legend(
        [pyplot.Rectangle((0, 0), 1, 1, color=color) for color in colors.values()],
        list(colors),
        loc="outside lower center",
        ncols=len(colors),
        fontsize="small",
    )
    return figure


def plain_numbers(axis):
    """Ticks at 1, 2 and 5 of each decade, written out."""
    from matplotlib import ticker

    axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(ticker.NullFormatter())
