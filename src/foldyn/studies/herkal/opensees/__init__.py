"""The case studies with shells of OpenSees: an independent check of `foldyn.shell`.

`model` and `run` need the package `opensees`; what they computed is stored in `results`, which
`stored` reads and `compare` sets beside our shell.
"""
