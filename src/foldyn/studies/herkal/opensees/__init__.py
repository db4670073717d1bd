"""The case studies with shells of OpenSees: an independent check of `foldyn.shell`.

`model` and `run` need the package `opensees`. Their results are stored in the folder `results`;
`stored` reads them, and `compare` compares them with our shell.
"""
