"""Other people's masters, which run an SSP in environments of their own."""
