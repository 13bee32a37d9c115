"""Force laws of bearings: oil films and their stand-ins."""
