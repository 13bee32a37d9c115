"""Contact of rough surfaces."""
