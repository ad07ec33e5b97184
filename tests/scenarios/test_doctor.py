from scenarios import doctor
from sim.render import context as gl


def named(checks):
    return {check.name: check for check in checks}


def test_missing_and_old_packages_come_with_the_command_that_mends_them(monkeypatch):
    required = ["rich>=13", "typer>=999", "no-such-package>=1", "pytest>=8; extra == 'dev'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _name: required)
    checks = named(doctor.check_packages())
    assert list(checks) == ["rich", "typer", "no-such-package"]
    assert checks["rich"].ok
    assert checks["rich"].remedy == ""
    assert not checks["typer"].ok
    assert "wanted 999" in checks["typer"].detail
    assert checks["no-such-package"].detail == "not installed"
    assert checks["no-such-package"].remedy.endswith("-m pip install 'no-such-package>=1'")


def test_a_second_opencv_is_found(monkeypatch):
    assert doctor.check_opencv().ok
    both = {"cv2": ["opencv-python", "opencv-python-headless"]}
    monkeypatch.setattr(doctor.metadata, "packages_distributions", lambda: both)
    check = doctor.check_opencv()
    assert not check.ok
    assert "uninstall -y opencv-python opencv-python-headless" in check.remedy


def test_missing_opengl_names_the_packages(monkeypatch):
    def fail():
        raise gl.RenderUnavailableError("no EGL")

    monkeypatch.setattr(gl, "context", fail)
    check = doctor.check_gl()
    assert not check.ok
    assert check.remedy == "sudo apt-get install -y libegl1 libgl1 libgl1-mesa-dri"


def test_video_codecs_are_there():
    assert all(check.ok for check in doctor.check_video())
    assert doctor.check_python().ok
