"""Bodies in frames and connections between them: what a user adds to an engine, or builds without one."""
