"""Pictures in space: a body's surface that moves, drawn as stills, animations and interactive pages."""
