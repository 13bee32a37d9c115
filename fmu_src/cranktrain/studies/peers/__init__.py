"""Other solvers on the model's own equations."""
