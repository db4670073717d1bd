"""The figure of verification.md: how far all stored values are from their references.

`python -m docs.verification_figure` writes images/verification.png.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from verification.table import BENCHMARKS, key, read

IMAGES = Path(__file__).with_name("images")


def main() -> None:
    """Draw a line of dots for each row, on a bar as wide as its test allows."""
    stored = read()
    figure, axes = plt.subplots(figsize=(8.0, 7.0), layout="constrained")
    for place, row in enumerate(BENCHMARKS):
        apart = 100.0 * (np.array(stored[key(row)]) / row.reference - 1.0)
        axes.barh(place, 200.0 * row.error, left=-100.0 * row.error, color="0.9", height=0.8)
        axes.plot(apart, np.full(len(apart), place), "o", color="C0", markersize=4, alpha=0.7)
    names = [f"{row.name} ({row.model.rpartition(', ')[2]})" for row in BENCHMARKS]
    axes.set_yticks(range(len(names)), [name.replace("`", "") for name in names], fontsize=8)
    axes.axvline(0.0, color="0.5", linewidth=0.8)
    axes.set(
        xlabel="difference to the reference, %", xlim=(-5.5, 5.5), ylim=(len(names) - 0.5, -0.5)
    )
    figure.savefig(IMAGES / "verification.png", dpi=110)


if __name__ == "__main__":
    main()
