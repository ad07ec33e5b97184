"""What works on this machine, what does not, and the command that mends it."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata

DISTRIBUTION = "testtrack"
HEADLESS = "opencv-python-headless"
MODULES = {  # where a distribution's module has another name
    "highway-env": "highway_env",
    HEADLESS: "cv2",
    "pyrender-maintained": "pyrender",
}

_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)(?:>=([\d.]+))?$")


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that was looked at.

    Attributes:
        name: What.
        ok: Whether it works.
        detail: What was found.
        remedy: The command that mends it; empty where nothing is wrong.
    """

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def examine() -> list[Check]:
    """Look at everything that testtrack needs."""
    # Read at the first import of OpenGL, which pyrender's import is.
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    return [check_python(), *check_packages(), check_opencv(), check_gl(), *check_video()]


def check_python() -> Check:
    """Check the interpreter's version."""
    found = ".".join(map(str, sys.version_info[:3]))
    ok = sys.version_info >= (3, 11)
    return Check(name="python", ok=ok, detail=found, remedy="" if ok else "make PYTHON=python3.11 setup")


def check_packages() -> Iterator[Check]:
    """Check that every distribution that testtrack requires is new enough and can be imported."""
    for requirement in metadata.requires(DISTRIBUTION) or ():
        if (match := _REQUIREMENT.match(requirement)) is None:
            continue  # of an extra
        name, wanted = match.groups()
        remedy = f"{sys.executable} -m pip install '{requirement}'"
        try:
            found = metadata.version(name)
            importlib.import_module(MODULES.get(name, name.replace("-", "_")))
        except metadata.PackageNotFoundError:
            yield Check(name=name, ok=False, detail="not installed", remedy=remedy)
        except Exception as error:  # whatever stops an import is what is looked for here
            detail = f"{found}, cannot be imported: {_first_line(error)}"
            yield Check(name=name, ok=False, detail=detail, remedy=remedy)
        else:
            ok = wanted is None or _numbers(found) >= _numbers(wanted)
            detail = found if ok else f"{found}, wanted {wanted} or newer"
            yield Check(name=name, ok=ok, detail=detail, remedy="" if ok else remedy)


def check_opencv() -> Check:
    """Check that nothing has put another OpenCV beside the headless one: both write into the same folder."""
    found = sorted(set(metadata.packages_distributions().get("cv2", ())))
    ok = found == [HEADLESS]
    pip = f"{sys.executable} -m pip"
    remedy = f"{pip} uninstall -y {' '.join(found)}; {pip} install {HEADLESS}".replace(
        "-y ;", "-y opencv-python;"
    )
    return Check(name="one OpenCV", ok=ok, detail=", ".join(found) or "none", remedy="" if ok else remedy)


def check_gl() -> Check:
    """Check that pictures can be drawn off screen."""
    from sim.render.context import DEBIAN_PACKAGES, RenderUnavailableError, context

    try:
        info = context().info
    except RenderUnavailableError as error:
        remedy = f"sudo apt-get install -y {' '.join(DEBIAN_PACKAGES)}"
        return Check(name="off-screen OpenGL", ok=False, detail=_first_line(error), remedy=remedy)
    return Check(name="off-screen OpenGL", ok=True, detail=f"{info['GL_RENDERER']}, {info['GL_VERSION']}")


def check_video() -> Iterator[Check]:
    """Check that recordings can be read, and videos written that browsers play."""
    remedy = f"{sys.executable} -m pip install --force-reinstall av"
    for what, codec, mode in (("H.264 decoder", "h264", "r"), ("H.264 encoder", "libx264", "w")):
        yield _attempt(what, lambda codec=codec, mode=mode: _open_codec(codec, mode), remedy)  # type: ignore[misc]


def _open_codec(codec: str, mode: str) -> str:
    import av

    av.Codec(codec, mode)  # type: ignore[arg-type]
    return f"{codec} of PyAV {av.__version__}"


def _attempt(name: str, action: Callable[[], str], remedy: str) -> Check:
    try:
        return Check(name=name, ok=True, detail=action())
    except Exception as error:  # whatever stops it is what is looked for here
        return Check(name=name, ok=False, detail=_first_line(error), remedy=remedy)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [repr(error)])[0]
