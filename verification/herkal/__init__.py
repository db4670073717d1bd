"""The case studies of Herkal et al. beyond the paper.

Settings that the paper does not state (`sensitivity`), other models of the sheet (`stiffnesses`),
another program's shell, and the specimen's model beside the paper's measurements (`vibration`) and
beside data that it made itself (`calibration`).
"""
