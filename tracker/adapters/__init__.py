"""Trackers of others, fed with detections. Each is imported only when it is built.

They bring another OpenCV, so they live in an environment of their own; from the repository's root:

    python -m venv .trackers
    .trackers/bin/pip install -e . filterpy stonesoup==1.9.1 defusedxml pyyaml requests tqdm
    .trackers/bin/pip install --no-deps norfair==2.3.0 supervision==0.25.1
"""
