"""The fast renderer: identity, depth and colour of one frame through OpenGL 4.3."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.render.antialias import smooth_edges
from sim.render.context import check, context
from sim.render.ground import MARGIN, cut, grain_texture, ground_texture, mark_table, vertex_layout
from sim.render.instances import COMMAND, CONTACT, INSTANCE, ROOM, Library, contacts, in_bands
from sim.render.lamps import HALO, LIGHTS, Burning, LampPlan, halos, lights
from sim.render.materials import material_table
from sim.render.pool import PoolPass
from sim.render.programs import program, set_uniforms
from sim.render.shadows import HEIGHTS, KINDS, ShadowPass
from sim.render.silhouettes import PLOT, Drawn, SilhouettePass
from sim.render.sky import HIGHEST, panorama, screen_grid
from sim.render.still import StillGround
from sim.render.types import Picture, Silhouettes, Stage
from sim.render.view import look_matrix, view_matrices
from sim.textures import texture_array
from sim.world import SKY_ID, Bodies, Lighting, WorldState

_BEAM = 44.0
_BODY_LIGHTS = 4  # lamps that light bodies, of those that light the ground


class GlRenderer:
    """Draws the world of one stage.

    A frame is one pass over the geometry, with one sample at each pixel's centre, that writes colour,
    identity and depth. Shadows are a mask that only the colours read, the sky and the glare of lamps are
    colour alone, and the stairs along edges are smoothed afterwards.

    Args:
        stage: What stands still.
        camera: Its size fixes the targets; `render` may change focal length and principal point.

    Raises:
        RenderUnavailableError: Without off-screen OpenGL.
    """

    def __init__(self, stage: Stage, camera: Camera) -> None:
        self._stage = stage
        self._size = (camera.width, camera.height)
        self._library = Library(stage.models)
        self._ground = cut(stage.ground)
        self._lamps = LampPlan(stage.models)
        self._streets = stage.light.night and stage.light.street_lamps
        self._things: list[Any] = []
        with context() as ctx:
            self._make_buffers(ctx)
            self._make_targets(ctx)
            self._make_textures(ctx)
            self._make_programs(ctx)
            check(ctx, "setting up the renderer")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give the graphics memory back. A second call does nothing."""
        with context() as ctx:
            # moderngl comes back to the framebuffer that was last in use: it must not be one of those that
            # end here.
            ctx.detect_framebuffer(0).use()
            while self._things:
                self._things.pop().release()

    def render(self, state: WorldState, camera: Camera, pose: Pose) -> Picture:
        """Draw one frame.

        Args:
            state: The vehicles.
            camera: Of the size given to the constructor.
            pose: The camera's pose.

        Raises:
            RenderError: If OpenGL reports an error.
        """
        with context() as ctx:
            self._draw(ctx, state, camera, pose)
            rgba, ids, depth = self._read()
            check(ctx, "rendering")
        return Picture(colour=smooth_edges(rgba), ids=ids, depth=depth)

    def silhouettes(self, state: WorldState, camera: Camera, pose: Pose) -> Silhouettes:
        """Draw each vehicle alone, as the identity pass draws it."""
        with context() as ctx:
            drawn = self._silhouettes.draw(ctx, self._library, state.vehicles, camera, pose)
            found: Silhouettes = self._silhouettes.count(ctx, drawn)
            check(ctx, "drawing silhouettes")
        return found

    def begin(self, state: WorldState, camera: Camera, pose: Pose) -> Drawn:
        """Ask for what `render` and `silhouettes` give; OpenGL draws while this thread goes on.

        `finish` gives it, and has to before the next one is asked for.
        """
        with context() as ctx:
            self._draw(ctx, state, camera, pose)
            drawn: Drawn = self._silhouettes.draw(ctx, self._library, state.vehicles, camera, pose)
            check(ctx, "rendering")
        return drawn

    def finish(self, drawn: Drawn) -> tuple[Picture, Silhouettes]:
        """Give what was asked for last."""
        with context() as ctx:
            rgba, ids, depth = self._read()
            found = self._silhouettes.count(ctx, drawn)
            check(ctx, "rendering")
        return Picture(colour=smooth_edges(rgba), ids=ids, depth=depth), found

    def _draw(self, ctx: Any, state: WorldState, camera: Camera, pose: Pose) -> None:
        """Ask OpenGL to draw the picture."""
        if state.lighting != self._lighting:
            self._shine(state.lighting)
        bodies = self._stage.bodies(state)
        selection = in_bands(bodies, self._library.select(bodies, camera, pose), pose)
        commands = self._library.commands(selection.meshes)
        stretches = self._ground.select(camera, pose)
        view = view_matrices(camera, pose)
        burning = self._lamps.burning(bodies, camera, pose, streets=self._streets)
        self._instances.write(self._library.instances(bodies, selection, pose))
        self._commands.write(commands)
        self._stretches.write(self._ground.stretches(stretches, pose))
        self._ground_commands.write(self._ground.commands(stretches))
        self._shadow_pass(ctx, bodies, camera, pose)
        if self._pool is not None:
            self._light_up(self._pool.program, burning, pose, LIGHTS)
            self._light_up(self._body, burning, pose, _BODY_LIGHTS)
            self._pool.draw(ctx, camera, pose)
            self._pool.use(6, 7)
        self._main_pass(ctx, view, (len(commands), len(stretches)), camera, pose)
        self._contact_pass(ctx, view, contacts(state.vehicles, pose))
        self._sky_pass(ctx, camera, pose)
        self._halo_pass(ctx, view, halos(burning, camera, night=self._stage.light.night)[:ROOM])

    def _shine(self, lighting: Lighting) -> None:
        """Set the light of one tick."""
        self._lighting, light = lighting, self._stage.light
        sky = np.array(lighting.sky)
        for shader in (self._body, self._paved, self._land, self._sky):
            set_uniforms(
                shader,
                # What a white surface that faces the sun sends back.
                u_sun_colour=tuple(light.sun_colour * lighting.sun / np.pi),
                u_zenith=tuple(light.zenith * sky),
                u_horizon=tuple(light.horizon * sky),
                u_shown=tuple(np.sqrt(sky)),
            )

    def _shadow_pass(self, ctx: Any, bodies: Bodies, camera: Camera, pose: Pose) -> None:
        self._shadows.draw(ctx, self._library, bodies, camera, pose)
        set_uniforms(self._body, u_slide=self._shadows.slide(camera, pose), u_ground=-float(pose.position[2]))

    def _main_pass(
        self, ctx: Any, view: dict[str, Any], draws: tuple[int, int], camera: Camera, pose: Pose
    ) -> None:
        self._target.use()
        ctx.enable_only(ctx.DEPTH_TEST | ctx.CULL_FACE)
        ctx.front_face = "cw"
        self._target.clear()
        for shader in (self._body, self._paved, self._land):
            set_uniforms(shader, **view)
        if (photo := self._stage.ground.photo) is not None:
            set_uniforms(self._paved, u_eye=tuple(pose.position[:2] - photo.low), u_extent=photo.extent)
        self._texture_array.use(0)
        self._grain.use(1)
        self._road.use(2)
        self._shadows.use(3)
        self._marks.use(5)
        self._body_array.render_indirect(self._commands, count=draws[0])
        self._ground_draws = draws[1]
        if self._still is not None:
            self._still.draw(self._target, self._shadows, camera, pose, self._lighting)
        else:
            self._paint_ground()

    def _paint_ground(self) -> None:
        count = self._ground_draws
        self._paved_array.render_indirect(self._ground_commands, count=count)
        self._land_array.render_indirect(self._ground_commands, count=count, first=count)

    def _sky_pass(self, ctx: Any, camera: Camera, pose: Pose) -> None:
        self._over.use()
        ctx.enable_only(ctx.DEPTH_TEST)
        ctx.depth_func = "<="
        self._panorama.use(4)
        ahead = pose.rotation[2]
        set_uniforms(self._sky, u_look=look_matrix(camera, pose), u_middle=np.arctan2(ahead[1], ahead[0]))
        self._sky_array.render()
        ctx.depth_func = "<"

    def _light_up(self, shader: Any, burning: Burning, pose: Pose, most: int) -> None:
        """Set what lamps light at night; the shaders of the day do not have it."""
        shining = lights(burning)
        ahead = pose.rotation[2] * [1, 1, 0]
        ahead /= np.sqrt(ahead @ ahead)
        set_uniforms(
            shader,
            u_lamps=min(shining.count, most),
            u_lamp_at=shining.position.tobytes(),
            u_lamp_colour=shining.colour.tobytes(),
            u_lamp_aim=shining.aim.tobytes(),
            u_ahead=tuple(ahead),
            u_right=(ahead[1], -ahead[0], 0.0),
        )

    def _contact_pass(self, ctx: Any, view: dict[str, Any], resting: NDArray[np.void]) -> None:
        if not len(resting):
            return
        self._resting.write(resting)
        self._over.use()
        self._over.depth_mask = False
        ctx.enable_only(ctx.DEPTH_TEST | ctx.BLEND)
        ctx.blend_func = ctx.ZERO, ctx.SRC_COLOR
        set_uniforms(self._contact, **view)
        self._contact_array.render(ctx.TRIANGLE_STRIP, vertices=4, instances=len(resting))
        self._over.depth_mask = True

    def _halo_pass(self, ctx: Any, view: dict[str, Any], glare: NDArray[np.void]) -> None:
        if not len(glare):
            return
        self._halos.write(glare)
        ctx.enable_only(ctx.DEPTH_TEST | ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE
        self._over.depth_mask = False
        width, height = self._size
        set_uniforms(self._halo, **view, u_pixel=(2 / width, 2 / height))
        self._halo_array.render(ctx.TRIANGLE_STRIP, vertices=4, instances=len(glare))
        self._over.depth_mask = True

    def _read(self) -> tuple[NDArray[np.uint8], NDArray[np.uint32], NDArray[np.float32]]:
        width, height = self._size
        ids, depth = np.empty((height, width), np.uint32), np.empty((height, width), np.float32)
        rgba = np.empty((height, width, 4), np.uint8)
        self._target.read_into(ids, components=1, attachment=1, dtype="u4")
        self._target.read_into(depth, components=1, attachment=2, dtype="f4")
        self._target.read_into(rgba, components=4)
        np.copyto(depth, np.inf, where=ids == SKY_ID)
        return rgba, ids, depth

    def _keep(self, thing: Any) -> Any:
        self._things.append(thing)
        return thing

    def _make_buffers(self, ctx: Any) -> None:
        keep = self._keep
        self._vertices = keep(ctx.buffer(self._library.vertices.tobytes()))
        self._faces = keep(ctx.buffer(self._library.faces.tobytes()))
        self._instances = keep(ctx.buffer(reserve=ROOM * INSTANCE.itemsize, dynamic=True))
        self._commands = keep(ctx.buffer(reserve=ROOM * COMMAND.itemsize, dynamic=True))
        self._resting = keep(ctx.buffer(reserve=ROOM * CONTACT.itemsize, dynamic=True))
        self._halos = keep(ctx.buffer(reserve=ROOM * HALO.itemsize, dynamic=True))
        chunks = len(self._ground.first)
        self._ground_vertices = keep(ctx.buffer(self._ground.vertices.tobytes()))
        self._ground_faces = keep(ctx.buffer(self._ground.faces.tobytes()))
        self._stretches = keep(ctx.buffer(reserve=chunks * 16, dynamic=True))
        self._ground_commands = keep(ctx.buffer(reserve=2 * chunks * COMMAND.itemsize, dynamic=True))

    def _make_targets(self, ctx: Any) -> None:
        keep, size = self._keep, self._size
        colour, depth = keep(ctx.renderbuffer(size, 4)), keep(ctx.depth_renderbuffer(size))
        ids, distances = (
            keep(ctx.renderbuffer(size, 1, dtype="u4")),
            keep(ctx.renderbuffer(size, 1, dtype="f4")),
        )
        self._target = keep(ctx.framebuffer([colour, ids, distances], depth))
        self._over = keep(ctx.framebuffer([colour], depth))

    def _make_textures(self, ctx: Any) -> None:
        keep, light = self._keep, self._stage.light
        layers = texture_array()
        self._texture_array = keep(
            ctx.texture_array((layers.shape[2], layers.shape[1], len(layers)), 4, layers.tobytes())
        )
        self._grain = self._mapped(ctx, grain_texture(light.seed))
        self._road = self._mapped(ctx, ground_texture(self._stage.ground, light.seed))
        self._texture_array.build_mipmaps()
        self._texture_array.filter = (ctx.LINEAR_MIPMAP_NEAREST, ctx.LINEAR)
        marks = mark_table(self._stage.ground)
        self._marks = keep(ctx.texture(marks.shape[1::-1], 4, marks.tobytes(), dtype="f4"))
        painted = panorama(light)
        self._panorama = keep(ctx.texture(painted.shape[1::-1], 4, painted.tobytes()))
        self._panorama.repeat_y = False

    def _mapped(self, ctx: Any, image: NDArray[np.uint8]) -> Any:
        texture = self._keep(ctx.texture(image.shape[1::-1], 4, image.tobytes()))
        texture.build_mipmaps()
        texture.filter = (ctx.LINEAR_MIPMAP_NEAREST, ctx.LINEAR)
        return texture

    def _make_programs(self, ctx: Any) -> None:
        keep, stage, light = self._keep, self._stage, self._stage.light
        night = ("NIGHT",) if light.night else ()
        shared = ("light", "lamps") if light.night else ("light",)
        self._shadows = keep(ShadowPass(ctx, self._size, light, self._vertices, self._faces))
        self._alone = keep(program(ctx, "body", "alone", "ALONE"))
        plots = keep(ctx.buffer(reserve=ROOM * PLOT.itemsize, dynamic=True))
        alone = keep(
            ctx.vertex_array(
                self._alone,
                [
                    (self._vertices, "3f 20x 1f", "in_position", "in_surface"),
                    (self._instances, "3f 2f 3f 8x 2f/i", "i_position", "i_turn", "i_scale", "i_lean"),
                    (plots, "4i 1i/i", "i_box", "i_first"),
                ],
                self._faces,
            )
        )
        buffers = self._instances, plots, self._commands
        self._silhouettes = keep(SilhouettePass(ctx, self._alone, alone, buffers, self._size))
        self._body = keep(program(ctx, "body", "body", "COLOUR", KINDS, HEIGHTS, *night, shared=shared))
        self._body_array = keep(
            ctx.vertex_array(
                self._body,
                [
                    (self._vertices, "3f 3f 2f 1f", "in_position", "in_normal", "in_uv", "in_surface"),
                    (
                        self._instances,
                        "3f 2f 3f 4f1 1u 2f/i",
                        "i_position",
                        "i_turn",
                        "i_scale",
                        "i_colour",
                        "i_id",
                        "i_lean",
                    ),
                ],
                self._faces,
            )
        )
        paint = "ROAD" if stage.ground.photo is None else "PHOTO"
        self._paved = keep(program(ctx, "ground", "ground", paint, *night, shared=("light",)))
        self._land = keep(program(ctx, "ground", "ground", *night, shared=("light",)))
        self._paved_array, self._land_array = (
            keep(
                ctx.vertex_array(
                    shader,
                    vertex_layout(shader, self._ground_vertices, self._stretches),
                    self._ground_faces,
                )
            )
            for shader in (self._paved, self._land)
        )
        self._sky = keep(program(ctx, "sky", "sky"))
        self._sky_grid = keep(ctx.buffer(screen_grid().tobytes()))
        self._sky_array = keep(ctx.vertex_array(self._sky, [(self._sky_grid, "2f", "in_corner")]))
        units = {"u_textures": 0, "u_grain": 1, "u_road": 2, "u_shadow": 3, "u_panorama": 4, "u_marks": 5}
        for shader in (self._body, self._paved, self._land, self._sky):
            set_uniforms(shader, **units, u_pool=6, u_mirror=7, u_sun=tuple(light.sun), u_haze=light.haze)
        self._shine(Lighting())
        set_uniforms(self._body, u_material=material_table())
        for shader in (self._paved, self._land):
            set_uniforms(shader, u_paved=stage.ground.paved, u_margin=MARGIN, u_wet=light.wet)
            set_uniforms(shader, u_frame=tuple(map(float, self._size)))
        set_uniforms(self._sky, u_highest=HIGHEST)
        # At night lamps that pass light it.
        self._still = None if light.night else keep(StillGround(ctx, self._size, self._paint_ground))
        self._pool = keep(PoolPass(ctx, self._size, light.wet)) if light.night else None
        for shader in (self._body, *([self._pool.program] if self._pool is not None else [])):
            set_uniforms(shader, u_beam=_BEAM, u_street=float(self._streets))
        self._halo = keep(program(ctx, "halo", "halo"))
        self._corners = keep(ctx.buffer(np.array([-1, -1, 1, -1, -1, 1, 1, 1], "<f4").tobytes()))
        self._contact = keep(program(ctx, "contact", "contact"))
        self._contact_array = keep(
            ctx.vertex_array(
                self._contact,
                [
                    (self._corners, "2f", "in_corner"),
                    (self._resting, "3f 2f 2f/i", "i_position", "i_turn", "i_half"),
                ],
            )
        )
        self._halo_array = keep(
            ctx.vertex_array(
                self._halo,
                [
                    (self._corners, "2f", "in_corner"),
                    (self._halos, "3f 1f 3f/i", "i_position", "i_radius", "i_colour"),
                ],
            )
        )
