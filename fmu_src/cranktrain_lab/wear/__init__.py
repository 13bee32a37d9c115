"""Running in over time: the wear of the main bearings' shells along a schedule of speeds and loads."""
