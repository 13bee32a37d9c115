"""The connecting rod: its big-end eye."""
