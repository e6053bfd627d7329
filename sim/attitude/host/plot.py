"""Plot of `boresight monitor`."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np

from boresight.gateware.attitude.system.attitude_frame import Update
from boresight.model.errors import InputError
from boresight.sim.plotting import COLOUR, INK, figure_and_axes, settings


def plot_image(
    times: Sequence[float], updates: Sequence[Update], gaps: Sequence[tuple[int, int]], format: str
) -> bytes:
    """An image of heading, pitch and roll over time, one under the other; missing frames are grey.

    Parameters
    ----------
    times : sequence of float
        Seconds.
    updates : sequence of Update
        An attitude for each time; InputError of other outputs.
    gaps : sequence of (int, int)
        Index of the attitude before a gap, frames missing there.
    format : str
        "png", "svg" or "pdf".
    """
    if not all(update.is_attitude for update in updates):
        raise InputError.at(
            "--output",
            wanted="attitudes",
            found="other outputs",
            fix="leave it out, or name a .csv",
        )
    holes = [index for index, _ in gaps]
    with settings():
        figure, axes = figure_and_axes(5.6, 3, 1, sharex=True)
        for axis, name in zip(axes, ("heading", "pitch", "roll"), strict=True):
            values = np.array([update.values[f"{name}_deg"] for update in updates])
            # The line is broken at gaps and where an angle wraps.
            wraps = np.flatnonzero(np.abs(np.diff(values)) > 180.0)
            breaks = np.union1d(wraps, holes).astype(int) + 1
            single = {"marker": "."} if len(values) < 3 else {}
            for index, _ in gaps:
                axis.axvspan(
                    times[index], times[index + 1], color=COLOUR["grey"], alpha=0.35, linewidth=0.8
                )
            axis.plot(
                np.insert(np.asarray(times, dtype=float), breaks, np.nan),
                np.insert(values, breaks, np.nan),
                color=COLOUR[name],
                **single,
            )
            axis.set_ylabel(f"{name} [deg]")
        missing = sum(count for _, count in gaps)
        note = f"{len(updates)} attitudes"
        if missing:
            note += f", {missing} missing (grey)"
        axes[0].set_title(note, loc="left", color=INK, fontsize=9.0)
        axes[-1].set_xlabel("time since the first [s]")
        image = io.BytesIO()
        figure.savefig(image, format=format, dpi=130)
    return image.getvalue()
