from foldyn.gradients.run_sensitivity import sensitivity as sensitivity

__all__: list[str]
