"""Draw ``double-winding.svg``: five wedges of value 1/2 that wind twice around a vertex, and three that wind once.

Run from the repository's root: ``python docs/draw_double_winding.py``.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("svg")

import matplotlib.pyplot as plt
import numpy as np

ARC = "#b3005e"


def star(axes: plt.Axes, steps: list[int], title: str) -> None:
    """Draw the spokes of a pentagon's centre and a closed walk of wedges, each a step of so many spokes."""
    angles = np.pi / 2 + 2 * np.pi * np.arange(5) / 5
    corners = np.column_stack((np.cos(angles), np.sin(angles)))
    axes.add_patch(plt.Polygon(corners, fill=False, edgecolor="0.6"))
    for corner in corners:
        axes.plot([0, corner[0]], [0, corner[1]], color="0.6", linewidth=0.8)
    at, radius = 0, 0.22
    for step in steps:
        turn = np.linspace(angles[0] + 2 * np.pi * at / 5, angles[0] + 2 * np.pi * (at + step) / 5, 60)
        radii = np.linspace(radius, radius + 0.11, 60)
        axes.plot(radii * np.cos(turn), radii * np.sin(turn), color=ARC, linewidth=1.8)
        axes.plot(radii[-1] * np.cos(turn[-1]), radii[-1] * np.sin(turn[-1]), "o", color=ARC, markersize=4)
        at, radius = at + step, radius + 0.11
    axes.plot(*corners.T, "o", color="black", markersize=5)
    axes.plot(0, 0, "o", color="black", markersize=6)
    axes.set_title(title, fontsize=10)
    axes.set_aspect("equal")
    axes.axis("off")


def main() -> None:
    """Write the picture beside this script."""
    plt.rcParams["svg.hashsalt"] = "bcut"
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.6, 3.9))
    star(left, [2, 2, 1], "a triangulation: three wedges, one turn")
    star(right, [2, 2, 2, 2, 2], "a fractional point: five wedges at 1/2, two turns")
    figure.tight_layout()
    figure.savefig(Path(__file__).with_name("double-winding.svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
