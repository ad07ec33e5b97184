"""What is true of a frame: boxes, visibility, occlusion events."""
