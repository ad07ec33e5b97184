"""What the aerial scene is made of: networks, traffic, bridges, land, the platform that looks down on them."""
