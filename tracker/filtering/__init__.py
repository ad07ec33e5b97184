"""What the trackers share: Kalman filter and gated assignment."""
