"""The same world through pyrender: physically based materials, an oracle of identity and depth."""

from __future__ import annotations

import os
from functools import cache
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sim.camera import Camera, Pose
from sim.models import Mesh, Surface
from sim.render.context import RenderUnavailableError
from sim.render.ground import MARGIN, PERIOD, cut, road_texture
from sim.render.instances import Library
from sim.render.types import Picture, Stage
from sim.textures import texture_array
from sim.world import GROUND_ID, WorldState

_ORIGIN_GRID = 256.0
_ROUGHNESS = {
    Surface.PAINT: 0.35,
    Surface.GLASS: 0.08,
    Surface.CHROME: 0.2,
    Surface.HEAD_LAMP: 0.2,
    Surface.TAIL_LAMP: 0.3,
}
_PAINTED = (
    Surface.PAINT,
    Surface.CARGO,
    Surface.FABRIC,
    Surface.FOLIAGE,
    Surface.FACADE,
    Surface.HILL,
)
_EXPOSURE = 3.0
_LAND = (0.16, 0.17, 0.09)

Key = tuple[int, int]


@cache
def _offscreen() -> Any:
    """Return the process's one pyrender renderer: deleting it would end EGL for all others in the process.

    Raises:
        RenderUnavailableError: If there is no EGL.
    """
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    try:
        import pyrender

        return pyrender.OffscreenRenderer(640, 480)
    except Exception as error:  # PyOpenGL raises whatever its platform's loader does
        raise RenderUnavailableError(str(error).splitlines()[0] if str(error) else repr(error)) from error


class PbrRenderer:
    """Draws the world of one stage through pyrender.

    Bodies are nodes that stay while they are drawn. All stands around an origin that follows the camera in
    steps, since pyrender computes in float32.

    Args:
        stage: What stands still.
        camera: Its near and far plane stay for all pictures.
        shadows: Whether the sun casts shadows.

    Raises:
        RenderUnavailableError: Without off-screen OpenGL.
    """

    def __init__(self, stage: Stage, camera: Camera, *, shadows: bool = True) -> None:
        _offscreen()
        import pyrender

        self._stage = stage
        self._library = Library(stage.models)
        self._ground = cut(stage.ground)
        self._flags = pyrender.RenderFlags.SHADOWS_DIRECTIONAL if shadows else pyrender.RenderFlags.NONE
        self._size = (camera.width, camera.height)
        light = stage.light
        ambient = 0.5 * (light.zenith + light.horizon)
        self._scene = pyrender.Scene(
            bg_color=[*np.sqrt(np.clip(light.horizon, 0, 1)), 1.0], ambient_light=ambient.tolist()
        )
        strength = float(light.sun_colour.max())
        sun = pyrender.DirectionalLight(
            color=light.sun_colour / max(strength, 1e-6), intensity=_EXPOSURE * strength
        )
        self._scene.add(sun, pose=_facing(light.sun))
        self._eye: Any = None
        self._origin = np.full(3, np.inf)
        self._nodes: dict[Key, Any] = {}
        self._meshes: dict[tuple[int, bytes], Any] = {}
        self._stretch_nodes: dict[int, Any] = {}
        self._stretch_meshes: dict[int, Any] = {}
        layers = texture_array()
        self._layers = [
            pyrender.Texture(source=np.ascontiguousarray(layer[..., :3]), source_channels="RGB")
            for layer in layers
        ]
        road = road_picture(stage)
        self._road = pyrender.Texture(source=road, source_channels="RGB")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Forget the scene. pyrender's own context stays for the process."""
        self._scene.clear()
        self._nodes.clear()
        self._meshes.clear()
        self._stretch_nodes.clear()
        self._stretch_meshes.clear()

    def render(self, state: WorldState, camera: Camera, pose: Pose) -> Picture:
        """Draw one frame: colour antialiased, identity and depth by a pass without materials.

        Args:
            state: The vehicles.
            camera: The intrinsics.
            pose: The camera's pose.
        """
        import pyrender

        codes = self._update(state, camera, pose)
        renderer = _offscreen()
        renderer.viewport_width, renderer.viewport_height = camera.width, camera.height
        colour, _ = renderer.render(self._scene, self._flags)
        painted, depth = renderer.render(
            self._scene,
            pyrender.RenderFlags.SEG,
            seg_node_map={node: code_colour(code) for code, (node, _) in enumerate(codes, start=1)},
        )
        table = np.array([0, *(identity for _, identity in codes)], np.uint32)
        code = (painted.astype(np.uint32) << np.array([16, 8, 0], np.uint32)).sum(axis=-1)
        ids = table[code]
        distance = np.where(ids == 0, np.float32(np.inf), depth.astype(np.float32))
        return Picture(colour=np.ascontiguousarray(colour[..., :3]), ids=ids, depth=distance)

    def _update(self, state: WorldState, camera: Camera, pose: Pose) -> list[tuple[Any, int]]:
        """Bring the scene up to date; return its mesh nodes with their identities."""
        import pyrender

        origin = np.round(pose.position / _ORIGIN_GRID) * _ORIGIN_GRID
        if not np.array_equal(origin, self._origin):
            for node in [*self._nodes.values(), *self._stretch_nodes.values()]:
                self._scene.remove_node(node)
            self._nodes.clear()
            self._stretch_nodes.clear()
            self._origin = origin
        if self._eye is not None:
            self._scene.remove_node(self._eye)
        eye = np.eye(4)
        eye[:3, :3] = (pose.rotation * [[1], [-1], [-1]]).T  # pyrender looks along -z with y upward
        eye[:3, 3] = pose.position - origin
        self._eye = self._scene.add(
            pyrender.IntrinsicsCamera(
                camera.focal, camera.focal, camera.cx, camera.cy, znear=camera.near, zfar=camera.far
            ),
            pose=eye,
        )
        bodies = self._stage.bodies(state)
        selection = self._library.select(bodies, camera, pose)
        chosen = bodies.take(selection.rows)
        scales = chosen.sizes / self._library.sizes[chosen.models]
        moving = len(self._stage.scenery) if state.sway is None else 0
        wanted: dict[Key, Any] = {}
        for k, (row, mesh) in enumerate(zip(selection.rows.tolist(), selection.meshes.tolist(), strict=True)):
            key = (int(chosen.ids[k]), mesh)
            node = self._nodes.pop(key, None)
            if node is None or row >= moving:
                place = placed(
                    chosen.positions[k] - origin, float(chosen.yaws[k]), scales[k], chosen.leans[k]
                )
                if node is None:
                    node = self._scene.add(self._mesh(mesh, chosen.colours[k]), pose=place)
                else:
                    self._scene.set_pose(node, place)
            wanted[key] = node
        for node in self._nodes.values():
            self._scene.remove_node(node)
        self._nodes = wanted
        stretches = self._ground.select(camera, pose).tolist()
        for number in [number for number in self._stretch_nodes if number not in stretches]:
            self._scene.remove_node(self._stretch_nodes.pop(number))
        for number in stretches:
            if number not in self._stretch_nodes:
                place = placed(self._ground.origins[number] - origin, 0.0, np.ones(3), np.zeros(2))
                self._stretch_nodes[number] = self._scene.add(self._stretch(number), pose=place)
        return [
            *((node, key[0]) for key, node in self._nodes.items()),
            *((node, GROUND_ID) for node in self._stretch_nodes.values()),
        ]

    def _mesh(self, index: int, colour: NDArray[np.float32]) -> Any:
        """Return a mesh of the library in a body's colour."""
        import pyrender

        tint = (np.clip(colour, 0, 1) * 255).astype(np.uint8)
        key = (index, tint.tobytes())
        if key not in self._meshes:
            mesh = self._library.mesh(index)
            primitives = []
            for surface in np.unique(mesh.surfaces):
                paint = (tint / 255.0) ** 2.2 if surface in _PAINTED else np.ones(3)
                primitives.append(self._primitive(mesh, Surface(surface), paint))
            self._meshes[key] = pyrender.Mesh(primitives)
        return self._meshes[key]

    def _primitive(self, mesh: Mesh, surface: Surface, paint: NDArray[np.float64]) -> Any:
        import pyrender

        faces = mesh.faces[mesh.surfaces[mesh.faces[:, 0]] == surface]
        material = pyrender.MetallicRoughnessMaterial(
            baseColorTexture=self._layers[surface],
            baseColorFactor=[*paint, 1.0],
            metallicFactor=0.9 if surface == Surface.CHROME else 0.0,
            roughnessFactor=_ROUGHNESS.get(surface, 0.9),
        )
        return pyrender.Primitive(
            positions=mesh.vertices,
            normals=mesh.normals,
            texcoord_0=mesh.uvs,
            indices=faces,
            material=material,
        )

    def _stretch(self, number: int) -> Any:
        """Return one stretch of ground: the paved band under its baked texture, plain land elsewhere."""
        import pyrender

        if number not in self._stretch_meshes:
            ground = self._ground
            first, count = int(ground.first[number]) // 3, int(ground.count[number]) // 3
            faces = ground.faces[first : first + count]
            vertices = ground.vertices[ground.base_vertex[number] :][: faces.max() + 1]
            low, high = self._stage.ground.paved
            uvs = np.column_stack(
                [(vertices[:, 4] - low + MARGIN) / (high - low + 2 * MARGIN), vertices[:, 3] / PERIOD]
            )
            offset = vertices[:, 4][faces]
            paved = (offset >= low - 0.01).all(axis=1) & (offset <= high + 0.01).all(axis=1)
            up = np.tile(np.array([0, 0, 1], np.float32), (len(vertices), 1))
            primitives = []
            for own, texture, factor in ((paved, self._road, (1.0, 1.0, 1.0)), (~paved, None, _LAND)):
                if not own.any():
                    continue
                material = pyrender.MetallicRoughnessMaterial(
                    baseColorTexture=texture,
                    baseColorFactor=[*factor, 1.0],
                    metallicFactor=0.0,
                    roughnessFactor=0.95,
                )
                primitives.append(
                    pyrender.Primitive(
                        positions=vertices[:, :3],
                        normals=up,
                        texcoord_0=uvs.astype(np.float32),
                        indices=faces[own],
                        material=material,
                    )
                )
            self._stretch_meshes[number] = pyrender.Mesh(primitives)
        return self._stretch_meshes[number]


def road_picture(stage: Stage) -> NDArray[np.uint8]:
    """Bake one period of the paved band with its marks, (2048, 512, 3) sRGB."""
    baked = road_texture(stage.ground, stage.light.seed).astype(float) / 255
    grey = 0.26 * baked[..., 0] * (1 - 0.45 * baked[..., 1])
    picture = np.repeat(np.sqrt(grey)[..., None], 3, axis=-1)
    low, high = stage.ground.paved[0] - MARGIN, stage.ground.paved[1] + MARGIN
    d = low + (np.arange(picture.shape[1]) + 0.5) / picture.shape[1] * (high - low)
    s = (np.arange(picture.shape[0]) + 0.5) / picture.shape[0] * PERIOD
    for edge, style in zip(stage.ground.lane_edges, stage.ground.line_styles, strict=True):
        if style:
            on = (s % 12.0 < 3.0) if style == 2 else np.ones(len(s), bool)
            picture[np.ix_(on, np.abs(d - edge) < 0.075)] = (0.79, 0.63, 0.28) if style in (3, 4) else 0.79
    return np.asarray(np.clip(picture, 0, 1) * 255 + 0.5, np.uint8)


def code_colour(code: int) -> tuple[int, int, int]:
    """Return the 24 bits of a code as a colour: pyrender paints nodes in colours of 8 bits a channel."""
    return code >> 16 & 255, code >> 8 & 255, code & 255


def placed(
    position: NDArray[np.float64], yaw: float, scale: NDArray[np.float64], lean: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (4, 4): scaled, turned about z, leaning, moved."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    out = np.eye(4)
    out[:3, :3] = np.array([[cos, -sin, lean[0]], [sin, cos, lean[1]], [0, 0, 1]]) * scale
    out[:3, 3] = position
    return out


def _facing(sun: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (4, 4) of a light that shines along its -z, from the direction of the sun."""
    side = np.cross([0.0, 0.0, 1.0], sun)
    side /= np.sqrt(side @ side)
    out = np.eye(4)
    out[:3, :3] = np.stack([side, np.cross(sun, side), sun], axis=1)
    return out
