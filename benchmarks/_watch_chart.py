"""Chart of the watch trials: detection against false alarms, over severity, and what is taken for what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from cranktrain.results.figures import save_figure

COLOURS = ("#1f6fb4", "#e07b20", "#2e9e6b", "#8c56a8")
SHADES = LinearSegmentedColormap.from_list("shades", ["#ffffff", "#1f6fb4"])
LEAST = 1e-3
SHORT = {
    "damper fluid thinner": "fluid thin", "damper ring seizing": "ring seizes", "damper springs cracked": "springs",
    "damper without its damping": "no damping", "connecting shaft softer": "shaft",
    "springs flywheel to secondary cracked": "bow springs", "springs secondary to dynamometer cracked": "rear shaft",
}  # fmt: skip


def draw(
    engines: Sequence[dict[str, Any]], path: str, rate: float, shown: Mapping[str, float], large: Mapping[str, float]
) -> None:
    """One row of three panels an engine: curves at severities ``shown``, the matrix at ``large`` ones."""
    figure = Figure(figsize=(14.5, 4.3 * len(engines)), dpi=110, layout="constrained")
    axes = np.atleast_2d(figure.subplots(len(engines), 3, width_ratios=(1.0, 1.0, 1.15)))
    for row, found in zip(axes, engines, strict=True):
        _against_alarms(row[0], found, rate, shown)
        _over_severity(row[1], found, rate)
        _matrix(row[2], found, large)
    save_figure(figure, path)


def _groups(found: dict[str, Any]) -> dict[str, list[str]]:
    """Defects that share a curve: misfires of all cylinders, and each other one."""
    groups: dict[str, list[str]] = {}
    for key, _ in found["conditions"]:
        word = "misfire" if found["kinds"][key] == "misfire" else found["words"][key]
        if key not in groups.setdefault(word, []):
            groups[word].append(key)
    return groups


def _near(found: dict[str, Any], key: str, severity: float) -> float:
    """Severity of a defect's trials that is nearest to one."""
    return min((s for k, s in found["conditions"] if k == key), key=lambda s: abs(s - severity))


def _rates(found: dict[str, Any], keys: Sequence[str], severity: float, limits: Any) -> Any:
    """Detection rates of some defects at a severity for limits of the probability."""
    drawn = np.concatenate([found["conditions"][key, severity].probabilities for key in keys])
    return (drawn[:, None] <= limits).mean(axis=0)


def _against_alarms(ax: Any, found: dict[str, Any], rate: float, shown: Mapping[str, float]) -> None:
    quiet = np.sort(found["quiet"])
    limits = np.unique(np.concatenate((quiet, [0.0, 1.0])))
    false = np.searchsorted(quiet, limits, side="right") / quiet.size
    for colour, (word, keys) in zip(COLOURS, _groups(found).items(), strict=False):
        severity = _near(found, keys[0], shown[found["kinds"][keys[0]]])
        name = f"{word}, {100.0 * severity:g} %"
        ax.plot(np.maximum(false, LEAST), _rates(found, keys, severity, limits), color=colour, lw=1.8, label=name)
    ax.plot(np.geomspace(LEAST, 1, 50), np.geomspace(LEAST, 1, 50), color="#999999", lw=1, ls=":", label="chance")
    ax.axvline(rate, color="#666666", lw=0.8, ls="--")
    own = float((quiet <= rate).mean())
    ax.text(rate * 1.15, 0.04, f"stated {100 * rate:g} %, measured {100 * own:.2g} %", fontsize=8, color="#444444")
    ax.set(xscale="log", xlim=(LEAST, 1.0), ylim=(0.0, 1.03), xlabel="false alarms", ylabel="detection rate")
    ax.set_title(f"{found['engine']}: detection against false alarms", fontsize=10, loc="left")
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8, framealpha=0.9, edgecolor="none", loc="upper left")


def _over_severity(ax: Any, found: dict[str, Any], rate: float) -> None:
    for colour, keys in zip(COLOURS, _groups(found).values(), strict=False):
        severities = sorted({severity for key, severity in found["conditions"] if key == keys[0]})
        detected = [float(_rates(found, keys, s, np.array([rate]))[0]) for s in severities]
        named = [
            float(np.mean([name == key for key in keys for name in found["conditions"][key, s].names]))
            for s in severities
        ]
        ax.plot(severities, detected, color=colour, lw=1.8, marker="o", ms=4)
        ax.plot(severities, named, color=colour, lw=1.2, marker="o", ms=3, mfc="white", ls="--")
    ax.axhline(rate, color="#999999", lw=1, ls=":")
    ax.set(xscale="log", ylim=(0.0, 1.03), xlabel="severity", ylabel="rate")
    ax.xaxis.set_major_formatter(lambda value, _: f"{100 * value:g} %")
    said = f"found at {100 * rate:g} % false alarms (dashed: and rightly named)"
    ax.set_title(said, fontsize=10, loc="left")
    ax.grid(alpha=0.25, which="both")


def _matrix(ax: Any, found: dict[str, Any], shown: Mapping[str, float]) -> None:
    keys = list(dict.fromkeys(key for key, _ in found["conditions"]))
    columns = [*keys, "other load, zero", "unexplained", ""]
    values = np.zeros((len(keys), len(columns)))
    for i, key in enumerate(keys):
        severity = _near(found, key, shown[found["kinds"][key]])
        names = found["conditions"][key, severity].names
        for name in names:
            own = "other load, zero" if found["kinds"].get(name) in ("load", "zero") else name
            values[i, columns.index(own)] += 1.0 / len(names)
    ax.imshow(values, cmap=SHADES, vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in zip(*np.nonzero(values >= 0.005), strict=True):
        ax.text(j, i, f"{100 * values[i, j]:.0f}", ha="center", va="center", fontsize=8,
                color="white" if values[i, j] > 0.6 else "#333333")  # fmt: skip

    def short(key: str) -> str:
        words = found["words"].get(key, key) or "no alarm"
        return SHORT.get(words, words.replace("misfire of cylinder ", "cyl. "))

    rows = [f"{short(key)}, {100 * _near(found, key, shown[found['kinds'][key]]):g} %" for key in keys]
    ax.set_xticks(range(len(columns)), [short(key) for key in columns], rotation=45, ha="right", fontsize=8)
    ax.set_yticks(range(len(keys)), rows, fontsize=8)
    ax.set_title("true defect (row) and what is named (column), %", fontsize=10, loc="left")
    ax.set_xticks(np.arange(-0.5, len(columns)), minor=True)
    ax.set_yticks(np.arange(-0.5, len(keys)), minor=True)
    ax.grid(which="minor", color="#dddddd", lw=0.6)
    ax.tick_params(which="minor", length=0)
