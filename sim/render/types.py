"""What every renderer takes and gives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim.models import Ground, Light, Model
from sim.world import Bodies, WorldState


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """All that stands still in an episode, ready to be drawn.

    Attributes:
        models: What bodies' ``models`` index.
        scenery: The bodies that never leave their places.
        ground: The ground (id 1).
        light: The light, before a state's `sim.world.Lighting`.
    """

    models: tuple[Model, ...]
    scenery: Bodies
    ground: Ground
    light: Light

    def bodies(self, state: WorldState) -> Bodies:
        """Return all that stands or drives at one tick: the scenery as it sways, then the vehicles."""
        scenery = self.scenery if state.sway is None else replace(self.scenery, leans=state.sway)
        return Bodies.concatenate(scenery, state.vehicles)


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One rendered frame.

    Attributes:
        colour: (H, W, 3) uint8, sRGB, before the sensor.
        ids: (H, W) uint32; 0 is the sky, 1 the ground.
        depth: (H, W) float32 metres along the axis at pixel centres, infinite in the sky.
    """

    colour: NDArray[np.uint8]
    ids: NDArray[np.uint32]
    depth: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Plots:
    """Which pixels each of N vehicles covers, row after row of a box that holds them.

    Attributes:
        boxes: (N, 4) int, x0, y0, x1, y1 px inside the frame.
        first: (N,) int, where in ``covered`` each one's pixels begin.
        covered: (P,) uint32, 1 where covered, else 0; there may be more than the N boxes hold.
    """

    boxes: NDArray[np.int32]
    first: NDArray[np.int32]
    covered: NDArray[np.uint32]

    def mask(self, k: int) -> NDArray[np.bool_]:
        """Return (h, w) what the vehicle ``k`` covers of its box."""
        x0, y0, x1, y1 = self.boxes[k].tolist()
        first = int(self.first[k])
        pixels = self.covered[first : first + (x1 - x0) * (y1 - y0)]
        return np.asarray(pixels.reshape(y1 - y0, x1 - x0) != 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Silhouettes:
    """Each of N vehicles drawn alone (amodal truth).

    Attributes:
        ids: (N,) uint32, the vehicles of which any part may lie in the extended frame.
        pixels: (N,) int64, pixels inside the frame.
        pixels_full: (N,) int64, pixels inside the frame extended by its width and height on every side.
        boxes: (N, 4) float64 x0, y0, x1, y1 of the extended silhouette, px; not a number if empty.
        plots: The parts inside the frame: truth needs them to tell who hides whom.
    """

    ids: NDArray[np.uint32]
    pixels: NDArray[np.int64]
    pixels_full: NDArray[np.int64]
    boxes: NDArray[np.float64]
    plots: Plots
