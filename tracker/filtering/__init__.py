"""What the trackers share: Kalman filter, gating, assignment."""
