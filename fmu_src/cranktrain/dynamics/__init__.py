"""The running model: equations of motion, time integration, simulation."""
