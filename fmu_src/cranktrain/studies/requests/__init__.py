"""Requests to the library: dataclasses with the options of each verb, and the functions made from them."""
