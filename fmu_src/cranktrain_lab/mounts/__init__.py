"""The engine as a rigid body on its mounts: modes, forces by order over speed, start and stop."""
