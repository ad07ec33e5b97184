"""Images in, tracks out. It knows no simulator."""
