"""Three-dimensional pictures of moving surfaces: stills, animations and interactive pages."""
