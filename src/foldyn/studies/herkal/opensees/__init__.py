"""The case studies with shells of OpenSees: an independent check of `foldyn.shell`.

`model` and `run` need the package `opensees`. Their results are stored in `results`, which `stored`
reads and `compare` compares with our shell.
"""
