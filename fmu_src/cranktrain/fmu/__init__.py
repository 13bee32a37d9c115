"""The FMU: description, data as one flat binary, interface of a scene."""
