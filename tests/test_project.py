"""What holds for the project as a whole."""

import subprocess
import sys
from importlib.metadata import distributions


def test_only_the_headless_opencv_is_installed():
    names = {d.metadata["Name"].lower().replace("_", "-") for d in distributions()}
    assert {n for n in names if n.startswith("opencv")} == {"opencv-python-headless"}


def test_trackers_import_without_the_simulator():
    code = (
        "import sys, pkgutil, importlib, tracker\n"
        "for m in pkgutil.walk_packages(tracker.__path__, 'tracker.'): importlib.import_module(m.name)\n"
        "heavy = ('sim', 'scenarios', 'highway_env', 'gymnasium', 'moderngl', 'pyrender', 'trimesh')\n"
        "print([m for m in heavy if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
