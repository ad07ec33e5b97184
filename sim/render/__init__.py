"""From world state to pictures: colour, id map and depth."""
