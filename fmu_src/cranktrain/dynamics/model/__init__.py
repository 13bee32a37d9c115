"""The running model as arrays: settings, bodies, ports, state, work memory."""
