from foldyn.gradients.sensitivity import sensitivity as sensitivity

__all__: list[str]
