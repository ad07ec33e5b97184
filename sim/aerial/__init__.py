"""What the aerial scene is made of: networks, traffic, bridges, land, and the platform above."""
