from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from sim.camera import Pose
from sim.render.gl import GlRenderer
from sim.render.types import Stage
from sim.world import FIRST_VEHICLE_ID, Bodies
from tests.sim.toy_stage import CAMERA, bodies, stage, state

# The sun throws the shadow of what is a metre high 0.75 m ahead and 0.94 m to the right.
PILLAR, BRIDGE = 1, 2


def car(x: float, y: float, z: float = 0.0) -> Bodies:
    one = bodies([(0, x, y, 0.0)], FIRST_VEHICLE_ID)
    return replace(one, positions=np.array([[x, y, z]]))


def seen(scenery: Bodies, vehicle: Bodies, look: Pose | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return (H, W, 3) colours and (H, W) whether the vehicle, and no edge of it, is there."""
    x, y, _ = vehicle.positions[0]
    pose = look or Pose.looking((x, y, 25.0), yaw=0.0, pitch=-np.pi / 2)
    world: Stage = replace(stage(), scenery=scenery)
    with GlRenderer(world, CAMERA) as renderer:
        picture = renderer.render(replace(state(), vehicles=vehicle), CAMERA, pose)
    own = ndimage.binary_erosion(picture.ids == FIRST_VEHICLE_ID, iterations=2)
    assert own.sum() > 100
    return picture.colour.astype(int), own


NOTHING = bodies([(PILLAR, 1000.0, 0.0, 0.0)], 2)


def test_a_car_in_a_bridges_shadow_is_darker_than_in_the_sun():
    bridge, there = bodies([(BRIDGE, 60.0, 0.0, 0.0)], 2), car(65.2, -1.8)
    (shaded, own), (sunny, same) = seen(bridge, there), seen(NOTHING, there)
    np.testing.assert_array_equal(own, same)
    assert (shaded[own].sum(axis=1) < 0.85 * sunny[own].sum(axis=1)).mean() > 0.9
    assert shaded[own].min() > 0  # what comes from the sky stays


def test_before_and_behind_a_bridges_shadow_the_sun_shines():
    bridge = bodies([(BRIDGE, 60.0, 0.0, 0.0)], 2)
    for x in (54.0, 72.0):
        (near, own), (sunny, _) = seen(bridge, car(x, -1.8)), seen(NOTHING, car(x, -1.8))
        np.testing.assert_array_equal(near[own], sunny[own])


def test_the_deck_does_not_shade_what_stands_on_it():
    bridge, there = bodies([(BRIDGE, 60.0, 0.0, 0.0)], 2), car(60.0, 0.0, 7.0)
    (upon, own), (aloft, _) = seen(bridge, there), seen(NOTHING, there)
    np.testing.assert_array_equal(upon[own], aloft[own])


def test_what_towers_over_a_deck_shades_it_there():
    # 13 m high: the ray from it to the car's roof, 8.5 m up, falls 3.4 m ahead and 4.2 m to the right.
    both = bodies([(BRIDGE, 60.0, 0.0, 0.0), (PILLAR, 57.0, 3.8, 0.0)], 2)
    both = replace(both, sizes=np.array([both.sizes[0], [4.0, 3.0, 13.0]]))
    there = car(60.0, 0.0, 7.0)
    (shaded, own), (sunny, _) = seen(both, there), seen(both.take(np.array([0])), there)
    assert (shaded[own].sum(axis=1) < 0.85 * sunny[own].sum(axis=1)).mean() > 0.3


@pytest.mark.parametrize(("height", "dark"), [(3.0, True), (0.7, False)])
def test_a_wall_shades_of_a_car_what_is_lower_than_the_ray_above_it(height, dark):
    # The ray through the bonnet, 1 m up, passes the wall 1.4 m up.
    wall = bodies([(PILLAR, 20.0, 2.0, 0.0)], 2)
    wall = replace(wall, sizes=np.array([[14.0, 0.5, height]]))
    there = car(20.0, 0.6)
    (shaded, own), (sunny, _) = seen(wall, there), seen(NOTHING, there)
    darker = (shaded[own].sum(axis=1) < 0.85 * sunny[own].sum(axis=1)).mean()
    assert darker > 0.5 if dark else darker == 0


def test_where_the_ray_meets_the_ground_behind_the_camera_the_sun_shines():
    # From above, against the sun's ray, at a car 7 m up: its ground point is behind the camera. The far
    # ground, where a point behind would be taken to lie, is in the shade of a wall.
    look = Pose.looking((20.0, -2.2, 10.0), yaw=np.arctan2(0.6, -0.48), pitch=-0.5)
    there, wall = car(17.5, 1.0, 7.0), bodies([(PILLAR, -15.0, 45.0, 0.0)], 2)
    wall = replace(wall, sizes=np.array([[100.0, 4.0, 40.0]]))
    (first, own), (sunny, _) = seen(wall, there, look), seen(NOTHING, there, look)
    assert (first[own] == sunny[own]).all(axis=1).mean() > 0.95
    assert first[~own].mean() < 0.9 * sunny[~own].mean()


def test_shade_is_in_the_colours_alone():
    world = replace(stage(), scenery=bodies([(BRIDGE, 60.0, 0.0, 0.0)], 2))
    dull = replace(world, light=replace(world.light, sun_colour=np.zeros(3)))
    look = Pose.looking((40.0, -1.8, 8.0), yaw=0.0, pitch=-0.3)
    pictures = []
    for place in (world, dull):
        with GlRenderer(place, CAMERA) as renderer:
            pictures.append(renderer.render(replace(state(), vehicles=car(64.5, -1.8)), CAMERA, look))
    np.testing.assert_array_equal(pictures[0].ids, pictures[1].ids)
    np.testing.assert_array_equal(pictures[0].depth, pictures[1].depth)
