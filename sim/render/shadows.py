"""The shadows that the sun casts, as a mask of the frame that the colours read."""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.camera import Camera, Pose
from sim.models import Light
from sim.render.instances import COMMAND, INSTANCE, ROOM, Library, in_bands
from sim.render.programs import program, set_uniforms
from sim.render.view import view_matrices
from sim.world import FIRST_VEHICLE_ID, Bodies

KINDS = f"FIRST_VEHICLE {FIRST_VEHICLE_ID}u"
"""What shaders that tell vehicles from scenery are to be compiled with."""

HEIGHTS = "TALLEST 32.0"
"""Metres, likewise: what casts a shadow from higher up counts as that high."""

_REACH = 120.0  # metres within which bodies cast shadows, for a camera near the ground
_ALOFT = 2.2  # camera heights within which they do, for one in the air
_WIDEN = 2.5  # half-widths of the frame within which they do
_LOWEST_SUN = 0.05


class ShadowPass:
    """Draws the shadows on flat ground and on bridges, and how high what casts them on the ground stands.

    A pixel of the mask speaks of the ground that the pixel would show if nothing stood on it: whether it lies
    in a shadow, whether a bridge that stood there would lie in a vehicle's, and how high the ray from there
    to the sun leaves the scenery. What is lower on that ray is in the shade, whatever it is.

    Args:
        ctx: The context, current.
        size: Width and height of the frame.
        light: Where the sun stands.
        vertices: The library's.
        faces: The library's.
    """

    def __init__(self, ctx: Any, size: tuple[int, int], light: Light, vertices: Any, faces: Any) -> None:
        self._sun = light.sun
        self._shines = bool(light.sun[2] > _LOWEST_SUN and light.sun_colour.any())
        self._mask = ctx.texture(size, 4)
        self._mask.repeat_x = self._mask.repeat_y = False
        self._target = ctx.framebuffer([self._mask])
        self._instances = ctx.buffer(reserve=ROOM * INSTANCE.itemsize, dynamic=True)
        self._commands = ctx.buffer(reserve=ROOM * COMMAND.itemsize, dynamic=True)
        self._shader = program(ctx, "body", "mask", "SHADOW", KINDS, HEIGHTS)
        names = "i_position", "i_turn", "i_scale", "i_id", "i_lean"
        self._array = ctx.vertex_array(
            self._shader,
            [
                (vertices, "3f 20x 1f", "in_position", "in_surface"),
                (self._instances, "3f 2f 3f 4x 1u 2f/i", *names),
            ],
            faces,
        )

    def release(self) -> None:
        """Give the graphics memory back."""
        made = self._array, self._shader, self._instances, self._commands, self._target, self._mask
        for thing in made:
            thing.release()

    def draw(self, ctx: Any, library: Library, bodies: Bodies, camera: Camera, pose: Pose) -> None:
        """Draw the mask of one frame."""
        self._target.use()
        self._target.clear()
        if not self._shines:
            return
        casters = library.select(bodies, camera, pose, widen=_WIDEN, coarsest=True)
        reach = max(_REACH, _ALOFT * float(pose.position[2]))
        casters = in_bands(bodies, casters.within(bodies, pose, reach), pose)
        commands = library.commands(casters.meshes)
        self._instances.write(library.instances(bodies, casters, pose))
        self._commands.write(commands)
        ctx.enable_only(ctx.BLEND)
        ctx.blend_equation = ctx.MAX
        set_uniforms(
            self._shader,
            **view_matrices(camera, pose),
            u_sun=tuple(self._sun),
            u_ground=-float(pose.position[2]),
        )
        self._array.render_indirect(self._commands, count=len(commands))
        ctx.blend_equation = ctx.FUNC_ADD

    def use(self, unit: int) -> None:
        """Bind the mask to a texture unit."""
        self._mask.use(unit)

    def slide(self, camera: Camera, pose: Pose) -> bytes:
        """Return the uniform ``u_slide``: to clip space from where the sun's ray goes on to the ground.

        It takes metres relative to the camera, as ``u_clip`` does.
        """
        clip = np.frombuffer(view_matrices(camera, pose)["u_clip"], "<f4").reshape(4, 4).T
        aside = self._sun / max(float(self._sun[2]), _LOWEST_SUN)
        fall = np.eye(4)
        fall[:3, 2] -= aside
        fall[:3, 3] = -float(pose.position[2]) * aside
        return (clip @ fall).T.astype("<f4").tobytes()
