"""Pictures of results: each function draws its data into axes that the caller made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BLUE, ORANGE, GREY = "#1f5a94", "#d9822b", "#8a8f98"


def plot_cycle(ax: Any, values: Array, quantity: str, unit: str, colour: str = BLUE) -> None:
    """Draw one cycle of uniform samples (n,) over the crank angle, its mean as a thin line."""
    n = values.size
    angle = np.arange(n + 1) * (720.0 / n)
    ax.axhline(float(values.mean()), color=GREY, lw=0.8, ls="--", label=f"mean {values.mean():.3g} {unit}")
    ax.plot(angle, np.append(values, values[0]), color=colour, lw=1.6)
    ax.set(xlim=(0, 720), xticks=np.arange(0, 721, 120), xlabel="crank angle over the last cycle / deg")
    ax.set_ylabel(f"{quantity} / {unit}")
    ax.set_title(f"{quantity}: {np.ptp(values):.3g} {unit} peak to peak", fontsize=10, loc="left")
    ax.grid(alpha=0.25)
    ax.legend(frameon=False, fontsize=8, loc="upper right")


def plot_orders(ax: Any, orders: Array, amplitudes: Array, quantity: str, unit: str, highest: float = 12.0) -> None:
    """Draw order amplitudes (k,), zero-to-peak, as bars; the strongest three carry their order."""
    keep = np.asarray(orders) <= highest
    x, y = np.asarray(orders)[keep], np.asarray(amplitudes)[keep]
    ax.bar(x, y, width=0.36, color=BLUE)
    for k in np.argsort(y)[-3:]:
        ax.annotate(f"{x[k]:g}", (x[k], y[k]), ha="center", va="bottom", fontsize=8)
    ax.set(
        xlim=(0, highest + 0.5), xticks=np.arange(0, highest + 0.1, 1.5), xlabel="order / oscillations per revolution"
    )
    ax.set_ylabel(f"{quantity}, zero to peak / {unit}")
    ax.margins(y=0.12)
    ax.grid(axis="y", alpha=0.25)


def plot_table(ax: Any, header: Sequence[str], rows: Sequence[Sequence[str]], title: str) -> None:
    """Draw a table of texts: one header, rows of the same length."""
    ax.axis("off")
    ax.set_title(title, fontsize=11, loc="left")
    table = ax.table(
        cellText=[list(row) for row in rows], colLabels=list(header), bbox=(0.0, 0.0, 1.0, 1.0), cellLoc="center"
    )
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    table.auto_set_column_width(list(range(len(header))))
    for (row, _), cell in table.get_celld().items():
        cell.set_edgecolor("#c8ccd2")
        if row == 0:
            cell.set_facecolor("#e8eef5")
            cell.set_text_props(weight="bold")


def plot_mode_shape(
    ax: Any, points: Array, triangles: NDArray[np.int64], displacement: Array, values: Array, label: str, scale: float
) -> Any:
    """Render a deformed surface, coloured by a value at its points.

    Parameters
    ----------
    ax : three-dimensional axes
    points : (n, 3) m, z along the crank axis; drawn along the horizontal axis
    triangles : (m, 3) indices of points
    displacement : (n, 3) m, drawn enlarged by ``scale``
    values : (n,) colour, e.g. the rotation about the crank axis; ``label`` names it for a colour bar

    Returns
    -------
    The collection, for a colour bar
    """
    from matplotlib import colormaps, colors
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    moved = (points + scale * displacement)[:, [2, 0, 1]]
    corners = moved[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    light = np.array([0.35, -0.65, 0.67])
    brightness = 0.45 + 0.55 * np.abs(normal @ light)
    limit = float(np.abs(values).max()) or 1.0
    norm = colors.Normalize(-limit, limit)
    colour = colormaps["coolwarm"](norm(values[triangles].mean(axis=1)))
    colour[:, :3] *= brightness[:, None]
    surface = Poly3DCollection(corners, facecolors=colour, edgecolors="none", linewidths=0.0, antialiased=False)
    surface.set_cmap("coolwarm")
    surface.set_norm(norm)
    surface.set_array(None)
    surface.set_label(label)
    ax.add_collection3d(surface)
    low, high = moved.min(axis=0), moved.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low)
    ax.view_init(elev=22, azim=-62)
    ax.set_axis_off()
    return surface


def plot_bearing_load(ax: Any, force_x: Array, force_y: Array, name: str) -> None:
    """Draw the force on a bearing (n,) N over a cycle as a polar load diagram, in kN, y up."""
    ax.plot(1e-3 * np.append(force_x, force_x[0]), 1e-3 * np.append(force_y, force_y[0]), color=ORANGE, lw=1.2)
    ax.axhline(0.0, color=GREY, lw=0.6)
    ax.axvline(0.0, color=GREY, lw=0.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="force x / kN", ylabel="force y / kN")
    ax.set_title(name, fontsize=10, loc="left")
    ax.grid(alpha=0.25)


def plot_pressure(ax: Any, angles_deg: Array, traces: dict[str, Array]) -> None:
    """Draw cylinder pressures (n,) Pa over the crank angle after firing dead centre, 0 in the middle."""
    order = np.argsort(np.where(angles_deg > 360.0, angles_deg - 720.0, angles_deg))
    shifted = np.where(angles_deg > 360.0, angles_deg - 720.0, angles_deg)[order]
    for (name, pressure), colour in zip(traces.items(), (BLUE, ORANGE, GREY, "black"), strict=False):
        ax.plot(shifted, 1e-6 * pressure[order], label=name, color=colour, lw=1.6)
    ax.set(xlim=(-360, 360), xticks=np.arange(-360, 361, 180), xlabel="crank angle after firing dead centre / deg")
    ax.set_ylabel("cylinder pressure, absolute / MPa")
    ax.grid(alpha=0.25)
    ax.legend(frameon=False)
