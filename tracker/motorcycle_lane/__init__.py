"""Paper 3: motorcycles in a lane, by a statistical background model and joint data association."""
