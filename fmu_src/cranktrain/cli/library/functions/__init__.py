"""Functions of the library, a file each, written by ``python -m cranktrain.cli.library``; do not edit them."""
