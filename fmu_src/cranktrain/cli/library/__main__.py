"""``python -m cranktrain.cli.library``: write the functions of the library after a verb has changed."""

from cranktrain.cli.library.writing import write

for changed in write():
    print(changed)
