"""Pure functions on ids and similarities: CLEAR, identity, HOTA, identification."""
