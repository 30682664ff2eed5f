"""Drawings of an assessment: courses over distance, with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from railenv.assessment.table import verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from railenv.assessment.assessment import Assessment
    from railenv.assessment.records import History

_COLOURS = ("#1f6f8b", "#c8432b", "#d98b1f", "#5a8f3c", "#7a5195", "#8c6d4f", "#3c4f76", "#b0457b")
_LIMIT: Any = {"color": "#3a3f42", "lw": 1.0, "ls": (0, (5, 3))}
_LABELS = {"N": ("kN", 1e-3), "m/s^2": ("m/s²", 1.0), "1": ("1", 1.0)}
_STYLE: Any = {
    "axes.grid": True,
    "grid.color": "#e3e6e8",
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#5c666b",
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 7,
    "legend.frameon": False,
}
_COLUMNS = 2
_HEADROOM = 0.3  # for the legend
_NEAR = 0.4  # of a limit: if all values are below it, the limit is printed instead of drawn


def plot_assessment(assessment: Assessment) -> Figure:
    """Draw a panel for each kind of history; a limit far above all values is given in words."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(history.name for history in assessment.histories))
    columns = min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(4.6 * columns, 0.4 + 2.3 * rows))
        figure.set_layout_engine("constrained", h_pad=0.06, w_pad=0.06)
        axes = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        for ax, name in zip(axes, names, strict=False):
            plot_histories(assessment, name, ax)
        for ax in axes[: len(names)][-columns:]:
            ax.set_xlabel("distance (m)")
            ax.tick_params(labelbottom=True)
        for ax in axes[len(names) :]:
            ax.set_visible(False)
        figure.suptitle(f"{assessment.model}: {verdict(assessment)}", fontsize=10, x=0.01, ha="left")
    return figure


def plot_histories(assessment: Assessment, name: str, ax: Axes) -> None:
    """Draw one quantity at all its places."""
    shown = [history for history in assessment.histories if history.name == name]
    unit, factor = _LABELS[shown[0].unit]
    for history, style in zip(shown, _styles(shown), strict=True):
        ax.plot(history.distance, factor * history.value, label=history.where, **style)
    limits = [history.limit for history in shown if history.limit is not None]
    title = name
    if limits:
        limit, largest = min(limits), max(float(abs(h.value).max()) for h in shown)
        title = f"{name}, limit {factor * limit:.3g} {unit}".removesuffix(" 1")
        if largest > _NEAR * limit:
            ax.axhline(factor * limit, **_LIMIT)
            if min(float(h.value.min()) for h in shown) < -_NEAR * limit:
                ax.axhline(-factor * limit, **_LIMIT)
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + _HEADROOM * (high - low))
    ax.set_xlim(*assessment.section)
    ax.set_ylabel(unit)
    ax.set_title(title)
    ax.legend(loc="upper left", ncols=4, columnspacing=1.0, handlelength=1.2)


def _styles(shown: list[History]) -> list[dict[str, Any]]:
    """Return a style for each place: a colour for each wheelset, dashes for its right wheel."""
    owners = list(dict.fromkeys(h.where.removesuffix(" right").removesuffix(" left") for h in shown))
    styles = []
    for history in shown:
        owner = history.where.removesuffix(" right").removesuffix(" left")
        colour = _COLOURS[owners.index(owner) % len(_COLOURS)]
        right = history.where.endswith(" right")
        styles.append({"color": colour, "lw": 1.0, "ls": (0, (2, 1)) if right else "-"})
    return styles
