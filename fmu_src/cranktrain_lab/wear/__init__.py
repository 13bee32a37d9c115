"""Running in over time: wear of the main bearings' shells along a schedule of speeds and loads."""
