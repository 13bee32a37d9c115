"""Bodies in frames and connections between them, which a user adds to an engine or builds without one."""
