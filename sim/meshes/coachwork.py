"""What vans, lorries and buses are put together from: swept bodies, flat patches, tyres, lamps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.meshes.builder import MeshBuilder
from sim.models import Surface

BACK = (-1.0, 0.0, 0.0)


def sweep(
    builder: MeshBuilder,
    profile: Sequence[tuple[float, float]],
    half: float,
    surfaces: Sequence[Surface],
    *,
    side: Surface,
    tops: Sequence[float] | None = None,
) -> None:
    """Sweep a side profile across the width.

    Args:
        builder: Takes the faces.
        profile: (x, z) points round a convex outline.
        half: Half width, metres.
        surfaces: One an edge, the i-th from point i to the next.
        side: Of both flanks.
        tops: Half width at each point, share of ``half``.
    """
    points = np.array([(x, 0.0, z) for x, z in profile])
    shares = np.ones(len(profile)) if tops is None else np.asarray(tops, float)
    left, right = points.copy(), points.copy()
    left[:, 1], right[:, 1] = half * shares, -half * shares
    centre = points.mean(axis=0)
    for i in range(len(profile)):
        j = (i + 1) % len(profile)
        quad = np.stack([left[i], left[j], right[j], right[i]])
        builder.polygon(quad, surfaces[i], facing=quad.mean(axis=0) - centre)
    builder.polygon(left, side, facing=(0, 1, 0))
    builder.polygon(right, side, facing=(0, -1, 0))


def rear_patch(
    builder: MeshBuilder,
    x: float,
    y: tuple[float, float],
    z: tuple[float, float],
    surface: Surface,
    lift: float = 0.012,
) -> None:
    """Add an upright patch that looks back."""
    builder.decal(
        [(x, y[1], z[0]), (x, y[0], z[0]), (x, y[0], z[1]), (x, y[1], z[1])], surface, facing=BACK, lift=lift
    )


def front_patch(
    builder: MeshBuilder,
    x: float,
    y: tuple[float, float],
    z: tuple[float, float],
    surface: Surface,
    lift: float = 0.012,
) -> None:
    """Add an upright patch that looks ahead."""
    corners = [(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])]
    builder.decal(corners, surface, facing=(1, 0, 0), lift=lift)


def side_patch(
    builder: MeshBuilder,
    y: float,
    x: tuple[float, float],
    z: tuple[float, float],
    surface: Surface = Surface.GLASS,
) -> None:
    """Add a patch on a flank at ``y``."""
    corners = [(x[0], y, z[0]), (x[1], y, z[0]), (x[1], y, z[1]), (x[0], y, z[1])]
    builder.decal(corners, surface, facing=(0, np.sign(y), 0))


def add_tyres(
    builder: MeshBuilder,
    axles: Sequence[float],
    half: float,
    radius: float,
    width: float,
    detail: int,
    arch: float = 0.0,
) -> None:
    """Add the wheels; ``arch`` is the radius of the dark wheel arch on the flank, 0 for none."""
    for x in axles:
        if detail == 0:
            builder.box(
                (x - radius * 0.85, -half * 0.98, 0),
                (x + radius * 0.85, half * 0.98, radius * 1.5),
                Surface.PLASTIC,
                without="+z-z",
            )
            continue
        for side in (1, -1):
            if detail == 2:
                builder.wheel((x, side * (half - width / 2), radius), radius, width, sides=10, outer=side)
                if arch:
                    turn = np.linspace(0, np.pi, 6)
                    outline = np.stack(
                        [x + arch * np.cos(turn), np.full(6, 0.0), radius + arch * np.sin(turn)], 1
                    )
                    outline[:, 1] = side * (half - 0.004)
                    builder.polygon(outline, Surface.PLASTIC, facing=(0, side, 0))
            else:
                y = sorted((side * half, side * (half - width)))
                builder.box(
                    (x - radius * 0.9, y[0], 0),
                    (x + radius * 0.9, y[1], 2 * radius),
                    Surface.RUBBER,
                    without="-z+z",
                    unit_uv=True,
                )


def add_tail_lamps(
    builder: MeshBuilder,
    rear: float,
    half: float,
    y: tuple[float, float],
    z: tuple[float, float],
    lift: float = 0.02,
) -> None:
    """Add tail lamps on both sides between shares ``y`` of the half width."""
    rear_patch(builder, rear, (half * y[0], half * y[1]), z, Surface.TAIL_LAMP, lift)
    rear_patch(builder, rear, (-half * y[1], -half * y[0]), z, Surface.TAIL_LAMP, lift)
