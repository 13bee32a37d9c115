"""Building of FMUs: model description, flat binary data, archive, interface of a scene."""
