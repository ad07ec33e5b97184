"""The simulated world and its cameras. It knows no tracker."""
