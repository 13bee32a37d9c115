"""Stresses of finite-element bodies: at nodes, of modes, of sub-models of a crank's throws."""
