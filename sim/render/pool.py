"""The pools of light that lamps throw on the ground at night, at a quarter of the frame's resolution.

They are smooth, and a loop over all lamps for every pixel would cost more than all the rest of the picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.camera import Camera, Pose
from sim.render.programs import program, set_uniforms
from sim.render.view import look_matrix

_COARSER = 4


class PoolPass:
    """Draws the light of lamps on the flat ground as two textures of the frame.

    Attributes:
        program: Whose uniforms of ``lamps.glsl`` are to be set before drawing.

    Args:
        ctx: The context, current.
        size: Width and height of the frame.
        wet: How wet the road is: its mirror images are sharper.
    """

    def __init__(self, ctx: Any, size: tuple[int, int], wet: float) -> None:
        coarse = tuple(-(-edge // _COARSER) for edge in size)
        self.program = program(ctx, "pool", "pool", shared=("lamps",))
        self._light, self._mirror = (ctx.texture(coarse, 4, dtype="f4") for _ in range(2))
        for texture in (self._light, self._mirror):
            texture.repeat_x = texture.repeat_y = False
        self._target = ctx.framebuffer([self._light, self._mirror])
        self._corners = ctx.buffer(np.array([-1, -1, 3, -1, -1, 3], "<f4").tobytes())
        self._array = ctx.vertex_array(self.program, [(self._corners, "2f", "in_corner")])
        set_uniforms(self.program, u_sharp=60.0 + 180.0 * wet)

    def release(self) -> None:
        """Give the graphics memory back."""
        for thing in (self._array, self._corners, self._target, self._light, self._mirror, self.program):
            thing.release()

    def draw(self, ctx: Any, camera: Camera, pose: Pose) -> None:
        """Draw both textures."""
        self._target.use()
        ctx.enable_only(ctx.NOTHING)
        set_uniforms(self.program, u_look=look_matrix(camera, pose), u_ground=-float(pose.position[2]))
        self._array.render()

    def use(self, light: int, mirror: int) -> None:
        """Bind the textures to texture units."""
        self._light.use(light)
        self._mirror.use(mirror)
