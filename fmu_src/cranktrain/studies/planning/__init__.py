"""Plans of scenes: choice of the lowest sufficient levels by measurements on the scene's model, and check runs."""
