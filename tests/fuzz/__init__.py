"""Every reader of the project against files and packets that are damaged, crafted or hostile: `make fuzz`.

`readers.py` is the list. `samples.py` makes sound files, `mutations.py`, `json_mutations.py` and `containers.py` spoil
them, `child.py` reads them under limits of time and memory, `rounds.py` counts what became of them.
"""
