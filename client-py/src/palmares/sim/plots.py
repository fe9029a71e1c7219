"""Figures of recorded runs, by matplotlib."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib.figure import Figure

from palmares.sim.state import Arrays

MOST_LINES = 8
"""Longest legend; of more lines only the ones with the largest values are named"""


class Plot(Figure):
    """A figure of matplotlib that a notebook shows as a picture."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=100)
        return file.getvalue()


def figure(
    title: str, arrays: Arrays, names: dict[str, list[str]], events: list[tuple[int, str, int | None]]
) -> Plot:
    """Return the figure of a run's arrays; vertical lines are events of the referee."""
    time = arrays["time"]
    forces = np.linalg.norm(arrays["finger_force"], axis=-1)
    rows = [
        ("score", arrays["score"][:, None], [], "steps-post"),
        ("motor σ", arrays["motors"][:, :, 0], names["motors"], "default"),
        ("tension, N", arrays["tension"], names["tendons"], "default"),
        ("force on\nfinger, N", forces, names["fingers"], "default"),
        ("height of\nbase, m", arrays["base"][:, 2:3], [], "default"),
    ]
    found = Plot(figsize=(8.0, 9.0), layout="constrained")
    found.suptitle(title)
    axes = found.subplots(len(rows), 1, sharex=True)
    for axis, (label, values, labels, style) in zip(axes, rows, strict=True):
        order = np.argsort(-np.abs(values).max(axis=0, initial=0.0), kind="stable")
        named = set(order[:MOST_LINES].tolist()) if labels else set()
        for k in range(values.shape[1]):
            shown = labels[k] if k in named else "_"
            axis.plot(time, values[:, k], drawstyle=style, linewidth=1.0, label=shown)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        for tick, _, _ in events:
            if tick < len(time):
                axis.axvline(time[tick], color="0.7", linewidth=0.6, zorder=0)
        if named:
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small", frameon=False)
    commands = arrays["command"]
    for k in range(min(commands.shape[1], MOST_LINES)):
        axes[1].plot(time, commands[:, k], color="0.5", linestyle=":", linewidth=0.8, label="_")
    axes[-1].set_xlabel("time, s")
    return found
