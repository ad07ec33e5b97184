"""The ground that is kept is the ground that is painted, bit for bit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from sim.camera import Pose
from sim.render.gl import GlRenderer
from sim.world import FIRST_VEHICLE_ID, Lighting
from tests.sim.toy_stage import CAMERA, bodies, stage, state

DIM = Lighting(sun=(0.4, 0.4, 0.4), sky=(0.8, 0.8, 0.9))


def test_frames_are_those_of_a_renderer_that_has_kept_nothing():
    """A car drives past a camera that stands, pans once and stands again; then the light changes."""
    poses = [Pose.looking((0.0, 0.0, 6.0), yaw=yaw, pitch=-0.4) for yaw in (0.0, 0.1)]
    views = [(poses[k >= 4], DIM if k >= 8 else Lighting()) for k in range(12)]
    world, shown = stage(), []
    with GlRenderer(world, CAMERA) as renderer:
        for k, (pose, lighting) in enumerate(views):
            car = bodies([(0, 12.0 + k, 0.5 * k - 2.0, 0.0)], FIRST_VEHICLE_ID)
            there = replace(state(), vehicles=car, lighting=lighting)
            picture = renderer.render(there, CAMERA, pose)
            with GlRenderer(world, CAMERA) as fresh:
                wanted = fresh.render(there, CAMERA, pose)
            for name in ("colour", "ids", "depth"):
                np.testing.assert_array_equal(getattr(picture, name), getattr(wanted, name))
            shown.append(picture.colour.astype(int))
    # The shadow moved, the view turned and the light fell.
    assert all(np.abs(one - other).max() > 20 for one, other in pairwise(shown))
    assert (shown[8] - shown[7]).mean() < -10
