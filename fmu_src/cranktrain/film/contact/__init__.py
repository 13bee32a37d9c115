"""Contact of the rough surfaces of journal and bearing shell."""
