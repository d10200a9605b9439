"""The experiments of `phalanx bench reconstruction`, one module each: those with a function `run`.

The first line of a module's docstring is its title; NEEDS names the folders of --data without which it is left out;
`run(arguments)` prints its table and hands back its figures.
"""
