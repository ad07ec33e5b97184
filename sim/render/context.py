"""The process's one OpenGL context, off screen through EGL."""

from __future__ import annotations

from functools import cache
from typing import Any

DEBIAN_PACKAGES = ("libegl1", "libgl1", "libgl1-mesa-dri")


class RenderUnavailableError(RuntimeError):
    """No off-screen OpenGL on this machine; the message names what to install."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"no off-screen OpenGL 4.3 through EGL ({reason}); "
            f"on Debian or Ubuntu: sudo apt-get install -y {' '.join(DEBIAN_PACKAGES)}"
        )


class RenderError(RuntimeError):
    """OpenGL reported an error: what was drawn cannot be trusted."""


@cache
def context() -> Any:
    """Return the process's moderngl context, made at the first call.

    There is one for all renderers, and it is never given back: ending a context ends EGL for whoever else
    uses it in the process. Use it inside ``with context() as ctx:`` only, since another library may hold the
    thread's current context, and call `check` before leaving.

    Raises:
        RenderUnavailableError: If there is no EGL, or no OpenGL 4.3 behind it.
    """
    try:
        import moderngl

        options: dict[str, Any] = {"standalone": True, "backend": "egl", "require": 430}
        made = moderngl.create_context(**options)
        _ = made.info  # asked once and kept; later another context, or none, may be current, which gives ""
        return made
    except Exception as error:  # moderngl raises bare Exception, glcontext several kinds of its own
        raise RenderUnavailableError(str(error).splitlines()[0] if str(error) else repr(error)) from error


def check(ctx: Any, where: str) -> None:
    """Raise if OpenGL has met an error since the last check.

    Args:
        ctx: The context, current.
        where: What was being done, for the message.

    Raises:
        RenderError: If so. moderngl itself stays silent when another library's context receives its calls.
    """
    error = ctx.error
    if error != "GL_NO_ERROR":
        raise RenderError(f"{error} while {where}")
