"""What all drawings share: style, colours, a figure where none is given, and labels that keep apart."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from ..analysis.critical import CriticalSpeed
from ..analysis.stability import FOUND, MARGINAL, NONE, UNSTABLE, StabilityLimit
from ..units import RPM

WIDTH = 6.3
"""Width of a figure [inch]: the text width of an A4 page."""

INK, GREY, FAINT, LIGHT = "#222222", "#5f646d", "#8a8f98", "#d9dce1"
RED = "#c8102e"
"""Kept for what is unstable."""

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#6a4c93", "#7f7f7f")
"""Distinct to the colour-blind (after Okabe and Ito), without the red."""

DASHES: dict[str, Any] = {"forward": "-", "backward": (0, (4.0, 2.0)), "planar": (0, (5.0, 1.5, 1.0, 1.5))}
"""Line style of each direction of whirl."""

STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "axes.linewidth": 0.7,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e3e5e8",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 5.0,
    "patch.linewidth": 0.7,
    "hatch.linewidth": 0.5,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.columnspacing": 1.4,
    "figure.dpi": 110.0,
    "savefig.dpi": 200.0,
    "svg.hashsalt": "amb_design",
}


OURS = "amb_design"
"""Marks the figures that were opened in our style, so that what is added later matches."""


def style() -> AbstractContextManager[None]:
    """The look of the drawings, for figures of your own.

    Returns
    -------
    context manager
        Inside it matplotlib's settings are those of the figures that the functions of this package open; they are
        restored at its end.
    """
    return mpl.rc_context(STYLE)  # type: ignore[arg-type]


@contextmanager
def canvas(ax: Axes | None, height: float = 3.6, width: float = WIDTH, **options: Any) -> Iterator[Axes]:
    """The axes given, or those of a new figure in our style, which is closed again if the drawing fails."""
    if ax is not None:
        ours = figure_of(ax).get_gid() == OURS
        with style() if ours else nullcontext():
            yield ax
        return
    with page(height, width) as figure:
        yield figure.add_subplot(**options)


@contextmanager
def page(height: float, width: float = WIDTH) -> Iterator[Figure]:
    """A new figure that pyplot knows, so that notebooks and ``plt.show`` display it."""
    import matplotlib.pyplot as plt  # chooses a window system: only when a figure is really wanted

    plt.draw_if_interactive()  # type: ignore[no-untyped-call]  # loads the window system, whose settings style() would undo
    with style():
        figure = plt.figure(figsize=(width, height), layout="constrained")
        figure.set_gid(OURS)
        try:
            yield figure
        except BaseException:
            plt.close(figure)
            raise


def save(drawing: Axes | Figure | Iterable[Axes], path: str | os.PathLike[str], *, close: bool = False) -> None:
    """Write a drawing to a file.

    Parameters
    ----------
    drawing : Axes, Figure or iterable of Axes
        What a function of this package returned.
    path : str or path
        Its ending says the format: png, svg, pdf.
    close : bool
        Close the figure afterwards; programs that draw many should.
    """
    first = drawing if isinstance(drawing, Axes | Figure) else next(iter(drawing))
    figure = first if isinstance(first, Figure) else figure_of(first)
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}  # the same drawing gives the same file
    ending = os.path.splitext(os.fspath(path))[1].lstrip(".").lower()
    with style():
        figure.savefig(path, metadata=undated.get(ending))
    if close:
        import matplotlib.pyplot as plt

        plt.close(figure)


def figure_of(ax: Axes) -> Figure:
    """The whole figure that holds the axes."""
    figure = ax.get_figure(root=True)
    if not isinstance(figure, Figure):
        raise ValueError("the axes belong to no figure any more")
    return figure


def halo(text: Text) -> Text:
    """Keep a text legible on top of lines."""
    text.set_path_effects([withStroke(linewidth=3.0, foreground="white")])
    return text


def legend_above(ax: Axes, handles: Sequence[Artist] | None = None) -> None:
    """Legend between the axes and the figure's upper edge, where no curve can run through it."""
    shown = list(handles) if handles is not None else ax.get_legend_handles_labels()[0]
    if not shown:
        return
    longest = max(len(str(handle.get_label())) for handle in shown)
    columns = int(size_in_points(ax)[0] / (4.0 * longest + 34.0))  # as many as the width bears
    ax.legend(
        handles=shown,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=min(max(columns, 1), len(shown)),
        borderaxespad=0.3,
    )


def size_in_points(ax: Axes) -> tuple[float, float]:
    """Width and height of the axes [pt], before constrained layout shrinks them a little."""
    box = ax.get_window_extent()
    scale = 72.0 / figure_of(ax).dpi
    return box.width * scale, box.height * scale


def spread(wanted: Sequence[float], apart: float, low: float, high: float) -> list[float]:
    """Move ascending places as little as needed to keep them apart and between two bounds."""
    placed: list[float] = []
    for place in wanted:
        placed.append(max(place, placed[-1] + apart if placed else low))
    ceiling = high
    for i in reversed(range(len(placed))):
        placed[i] = min(placed[i], ceiling)
        ceiling = placed[i] - apart
    return placed


def shade(ax: Axes, name: str, x: tuple[float, float] | None, y: tuple[float, float] | None, colour: str) -> None:
    """Fill a band once, without influence on the limits of the axes; None spans the axes."""
    if any(artist.get_gid() == name for artist in ax.get_children()):
        return
    transform = ax.transData if x and y else ax.get_xaxis_transform() if x else ax.get_yaxis_transform()
    (left, right), (low, high) = x or (0.0, 1.0), y or (0.0, 1.0)
    band = Rectangle((left, low), right - left, high - low, transform=transform, facecolor=colour, linewidth=0.0)
    band.set_zorder(0.1)
    band.set_gid(name)
    ax.add_artist(band)


def mark_limit(
    ax: Axes, limit: StabilityLimit, *, windows: bool = True, note_below: bool = False, text_below: bool = False
) -> None:
    """Stability limit speed as a vertical line over a speed axis in rpm, speeds of instability shaded."""
    for start, stop in unstable_windows(limit) if windows else ():
        shade(ax, f"unstable {start:.6g}", (start / RPM, stop / RPM), None, "#fbe9ea")
    text = {
        FOUND: f"SLS {limit.speed_rpm:.0f} rpm",
        NONE: f"stable up to {limit.speed_rpm:.0f} rpm",
        UNSTABLE: "unstable at rest",
        MARGINAL: "marginally stable",
    }[limit.status]
    if limit.status == FOUND:
        ax.axvline(limit.speed_rpm, color=RED, linewidth=1.2)
        along(ax, limit.speed_rpm, text, RED, after=True, below=text_below)
    else:
        note(ax, text, RED if limit.status == UNSTABLE else INK, below=note_below)


def unstable_windows(limit: StabilityLimit) -> list[tuple[float, float]]:
    """Ranges of speed [rad/s] with at least one unstable mode, up to the speed that was looked at."""
    starts = [0.0] if limit.status == UNSTABLE else []
    stops: list[float] = []
    for onset in limit.onsets:
        if onset.count > 0 and len(starts) == len(stops):
            starts.append(onset.speed)
        elif onset.count == 0:
            stops.append(onset.speed)
    return list(zip(starts, [*stops, limit.top_speed], strict=False))


def along(ax: Axes, x: float, text: str, colour: str, *, after: bool, below: bool) -> Text:
    """A text along a vertical line, at its upper or lower end, after it or before it unless there is no room."""
    low, high = ax.get_xlim()
    place = (x - low) / (high - low)
    right = place < 0.95 if after else place < 0.05
    return halo(
        ax.annotate(
            text,
            (x, 0.0 if below else 1.0),
            xycoords=ax.get_xaxis_transform(),
            xytext=(2.0 if right else -2.0, 4.0 if below else -3.0),
            textcoords="offset points",
            rotation=90.0,
            ha="left" if right else "right",
            va="bottom" if below else "top",
            fontsize="small",
            color=colour,
            zorder=5,
        )
    )


def note(ax: Axes, text: str, colour: str = INK, *, below: bool = False) -> Text:
    """A remark in the upper left (or lower right) corner, next to earlier ones."""
    gid = "note below" if below else "note"
    earlier = sum(t.get_gid() == gid for t in ax.texts)
    away = 4.0 + 10.5 * earlier
    remark = ax.annotate(
        text,
        (1.0, 0.0) if below else (0.0, 1.0),
        xycoords="axes fraction",
        xytext=(-5.0, away) if below else (5.0, -away),
        textcoords="offset points",
        ha="right" if below else "left",
        va="bottom" if below else "top",
        fontsize="small",
        color=colour,
        gid=gid,
        zorder=6,
    )
    return halo(remark)


def mark_critical(ax: Axes, critical: Sequence[CriticalSpeed]) -> None:
    """Forward critical speeds of lightly damped rotor modes as thin vertical lines over a speed axis in rpm."""
    shown = [c for c in critical if c.whirl != "backward" and c.kind == "rotor" and c.damping_ratio < 0.3]
    for c in shown:
        ax.axvline(c.speed_rpm, color=FAINT, linewidth=0.8, linestyle=(0, (1.0, 2.0)), zorder=0.5)
        along(ax, c.speed_rpm, f"{c.speed_rpm:.0f} rpm", GREY, after=False, below=True)


def hertz(frequency: float) -> str:
    """A frequency [rad/s] in words."""
    value = frequency / (2.0 * math.pi)
    return f"{value:.0f} Hz" if value >= 100.0 else f"{value:.3g} Hz"


def minus(text: str) -> str:
    """A text with a proper minus sign."""
    return text.replace("-", "\u2212")
