"""Paper 2: tracking and re-acquisition of vehicles in aerial video, by motion and appearance contexts."""
