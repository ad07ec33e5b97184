"""What the trackers learnt from simulated drives, and how."""
