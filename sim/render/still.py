"""The ground kept from frame to frame: while camera and light stand still only its shadows change.

It is painted twice, all in the sun and all in the shade, by what paints it in every frame otherwise; each
pixel then shows the one or the other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.render.programs import program, set_uniforms
from sim.world import Lighting

_MASK, _KEPT = 3, 8  # texture units


class StillGround:
    """Draws the ground, anew if the view or the light is another than in the frame before.

    Args:
        ctx: The context, current.
        size: Width and height of the frame.
        paint: Draws the ground into what is in use, with the shadow mask of the texture unit 3.
    """

    def __init__(self, ctx: Any, size: tuple[int, int], paint: Callable[[], None]) -> None:
        self._paint, self._size = paint, size
        self._seen: tuple[object, ...] = ()
        self._painted = False
        # Masks of nothing and of everything.
        self._masks = [ctx.texture(size, 4, bytes([value]) * (4 * size[0] * size[1])) for value in (0, 255)]
        self._attached = [ctx.renderbuffer(size, 4), ctx.renderbuffer(size, 1, dtype="u4")]
        self._attached += [ctx.renderbuffer(size, 1, dtype="f4"), ctx.depth_renderbuffer(size)]
        self._target = ctx.framebuffer(self._attached[:3], self._attached[3])
        self._kept = ctx.texture(size, 4, dtype="u4")
        self._program = program(ctx, "still", "still")
        set_uniforms(self._program, u_shadow=_MASK, u_kept=_KEPT)
        # Clockwise, as all that is drawn.
        self._corners = ctx.buffer(np.array([-1, -1, -1, 3, 3, -1], "<f4").tobytes())
        self._array = ctx.vertex_array(self._program, [(self._corners, "2f", "in_corner")])

    def release(self) -> None:
        """Give the graphics memory back."""
        made = self._array, self._corners, self._program, self._kept, self._target
        for thing in (*made, *self._attached, *self._masks):
            thing.release()

    def draw(self, target: Any, mask: Any, camera: Camera, pose: Pose, lighting: Lighting) -> None:
        """Draw the ground behind what stands on it.

        Args:
            target: The framebuffer in use, to which the rest of the frame has been drawn.
            mask: The shadows: what has ``use``.
            camera: The intrinsics.
            pose: The camera's pose.
            lighting: Of the tick.
        """
        seen = camera, pose.position.tobytes(), pose.rotation.tobytes(), lighting
        if seen != self._seen:
            self._seen, self._painted = seen, False
            self._paint()
            return
        if not self._painted:
            self._keep()
            target.use()
            mask.use(_MASK)
            self._painted = True
        self._kept.use(_KEPT)
        self._array.render()

    def _keep(self) -> None:
        """Paint the ground in the sun and in the shade."""
        width, height = self._size
        kept = np.empty((height, width, 4), np.uint32)
        for k, shadows in enumerate(self._masks):
            self._target.use()
            self._target.clear()
            shadows.use(_MASK)
            self._paint()
            kept[..., k] = self._read(0, 4, "f1")
        kept[..., 2] = self._read(2, 1, "f4")
        kept[..., 3] = self._read(-1, 1, "f4")
        self._kept.write(kept.tobytes())

    def _read(self, attachment: int, components: int, dtype: str) -> NDArray[np.uint32]:
        """Return (H, W) what has been painted, its bits taken for whole numbers."""
        bits = self._target.read(components=components, attachment=attachment, dtype=dtype, alignment=1)
        return np.frombuffer(bits, "<u4").reshape(self._size[::-1])
