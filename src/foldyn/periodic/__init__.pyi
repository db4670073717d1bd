from foldyn.periodic.motion import periodic_motion as periodic_motion
from foldyn.periodic.normal_modes import backbone as backbone
from foldyn.periodic.response import response_curve as response_curve

__all__: list[str]
